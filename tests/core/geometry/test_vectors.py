"""Dot products and lengths of rows."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry.vectors import normalized, row_dot


def test_dot_products_are_those_of_one_row_after_the_other():
    a, b = np.random.default_rng(0).normal(size=(2, 20, 3))
    assert_allclose(row_dot(a, b), [np.dot(x, y) for x, y in zip(a, b)])


def test_normalized_vectors_have_length_one_whatever_their_unit_and_zero_stays_zero():
    vectors = np.random.default_rng(1).normal(size=(4, 5, 3))
    vectors[2, 3] = 0.0
    unit = normalized(vectors)
    lengths = np.linalg.norm(unit, axis=-1)
    assert_allclose(np.delete(lengths.ravel(), 13), 1.0)
    assert_array_equal(unit[2, 3], 0.0)
    assert_allclose(normalized(1e-6 * vectors), unit)
