"""Partners of centers, against the dense optimum."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.optimize import linear_sum_assignment

from refmesh_addon.core.tracking.renumbering import assignment

RNG = np.random.default_rng(0)
BEFORE = RNG.random((80, 3))


def test_shuffled_centers_are_found_again():
    order = RNG.permutation(len(BEFORE))
    assert_array_equal(order[assignment(BEFORE, BEFORE[order])], np.arange(len(BEFORE)))


@pytest.mark.parametrize("scale", [1e-3, 1.0, 50.0])
def test_the_sum_of_squared_distances_is_the_least(scale):
    after = RNG.random((80, 3))
    table = ((BEFORE[:, None] - after[None]) ** 2).sum(axis=2)
    rows, columns = linear_sum_assignment(table)
    partners = assignment(scale * BEFORE, scale * after)
    assert sorted(partners) == list(range(80))
    assert table[rows, partners].sum() == pytest.approx(table[rows, columns].sum(), rel=1e-6)


def test_centers_that_crowd_elsewhere_still_get_one_partner_each():
    after = np.vstack([BEFORE[:20], 100 + RNG.random((60, 3))])
    partners = assignment(BEFORE, after)
    assert sorted(partners) == list(range(80))


def test_different_numbers_of_centers_are_refused():
    with pytest.raises(ValueError, match="same shape"):
        assignment(BEFORE, BEFORE[:5])
