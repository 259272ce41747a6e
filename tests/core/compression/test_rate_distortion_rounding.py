import numpy as np

from refmesh_addon.core.compression import rate_distortion_rounding
from refmesh_addon.core.compression.rate_distortion_rounding import rate_distortion_rounded
from refmesh_addon.core.geometry.vectors import normalized

RNG = np.random.default_rng(4)


def test_numbers_are_whole_and_near():
    shapes = 20 * RNG.standard_normal((3, 150, 3))
    normals = normalized(RNG.standard_normal((5, 150, 3)))
    rounded = rate_distortion_rounded(shapes, np.column_stack([np.ones(5), RNG.random((5, 2))]), normals)
    np.testing.assert_array_equal(rounded, np.rint(rounded))
    assert np.abs(rounded[0] - shapes[0]).max() <= 1.5


def test_whole_numbers_stay(monkeypatch):
    monkeypatch.setattr(rate_distortion_rounding, "BIT", 0.0)
    shapes = np.rint(20 * RNG.standard_normal((3, 70, 3)))
    weights = np.column_stack([np.ones(6), RNG.random((6, 2))])
    np.testing.assert_array_equal(rate_distortion_rounded(shapes, weights, normalized(RNG.standard_normal((6, 70, 3)))), shapes)


def test_a_later_shape_makes_up_for_what_an_earlier_one_lost():
    """One frame that shows both shapes in full: their sum is right to half a step, along the normal, though each is rounded."""
    shapes, normals = 9 * RNG.standard_normal((2, 200, 3)), normalized(RNG.standard_normal((1, 200, 3)))
    missed = rate_distortion_rounded(shapes, np.ones((1, 2)), normals).sum(axis=0) - shapes.sum(axis=0)
    plain = np.rint(shapes).sum(axis=0) - shapes.sum(axis=0)
    along = lambda vectors: np.sqrt((np.einsum("va,va->v", vectors, normals[0]) ** 2).mean())
    assert along(missed) < 0.7 * along(plain)


def test_a_still_neighborhood_takes_one_value_where_it_costs_nothing():
    """Vertices of a plane with slightly different places along it: only those along its normal count."""
    shapes = np.zeros((1, 64, 3))
    shapes[0] = [5.0, 5.0, 3.0]
    shapes[0, :, :2] += 0.8 * (RNG.random((64, 2)) - 0.5)
    rounded = rate_distortion_rounded(shapes, np.ones((4, 1)), np.broadcast_to([0.0, 0.0, 1.0], (4, 64, 3)))
    assert len(np.unique(rounded[0, 1:], axis=0)) == 1
