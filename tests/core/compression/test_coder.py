import numpy as np
import pytest

from refmesh_addon.core.compression.coder import (
    CLASSES,
    FRACTION,
    LARGEST,
    TOTAL,
    frequencies,
    low_bits,
    magnitude_classes,
    table_parameters,
)


@pytest.mark.parametrize("zero", [1, 3, 128, 250, 255])
@pytest.mark.parametrize("one", [1, 128, 255])
@pytest.mark.parametrize("decay", [0, 1, 128, 255])
def test_every_table_can_code_every_symbol(zero, one, decay):
    table = frequencies((zero, one, decay))
    assert table.dtype == np.int64 and table.sum() == TOTAL and (table >= 1).all()
    np.testing.assert_array_equal(table, table[::-1])


@pytest.mark.parametrize("scale", [0.1, 0.3, 1.0, 4.0])
def test_a_fitted_table_costs_little_more_than_the_entropy(scale):
    magnitudes = np.abs(np.rint(np.random.default_rng(1).laplace(scale=scale, size=20000))).astype(int)
    counts = np.bincount(np.minimum(magnitudes, LARGEST + 1), minlength=LARGEST + 2).astype(float)
    table = frequencies(table_parameters(counts))
    halved = np.concatenate([[table[LARGEST + 1]], 2 * table[LARGEST + 2 :]]) / TOTAL
    share = counts[counts > 0] / counts.sum()
    assert -(counts * np.log2(halved)).sum() < 1.02 * -(share * np.log2(share)).sum() * len(magnitudes) + 100


def test_classes_rise_by_half_octaves():
    expected = np.array([0, 1, 2, 3, 4, 6, 8, 1 << 40])
    np.testing.assert_array_equal(magnitude_classes(expected), [0, 1, 2, 3, 4, 5, 6, CLASSES - 1])


def test_only_large_values_have_random_low_bits():
    assert low_bits(int(magnitude_classes(np.array(2 * FRACTION)))) == 0
    assert low_bits(int(magnitude_classes(np.array(64 * FRACTION)))) == 5
