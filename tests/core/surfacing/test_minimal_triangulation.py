"""The triangulation of least area: against all triangulations, on a concave polygon, and with diagonals that must not be used."""

import numpy as np
import pytest

from refmesh_addon.core.geometry.mesh import triangle_areas, triangle_shapes
from refmesh_addon.core.surfacing.minimal_triangulation import SLIVERS, minimal_triangulation
from refmesh_addon.core.types import TriangleMesh

STAR = np.array([[np.cos(a) * r, np.sin(a) * r, 0.0] for a, r in zip(np.arange(10) * np.pi / 5, [1.0, 0.4] * 5)])


def every_triangulation(start, end):
    """All triangulations of corners start to end of a polygon, one by one."""
    if end - start < 2:
        yield []
    for split in range(start + 1, end):
        for left in every_triangulation(start, split):
            for right in every_triangulation(split, end):
                yield [(start, split, end), *left, *right]


def area(corners, triangles):
    return triangle_areas(TriangleMesh(corners, triangles)).sum()


def cost(corners, triangles):
    sides = corners[np.array(triangles)] - corners[np.roll(triangles, 1, axis=1)]
    return area(corners, triangles) + SLIVERS * ((sides**2).sum(axis=(1, 2)) / triangle_shapes(corners[np.array(triangles)])[1]).sum()


@pytest.mark.parametrize("seed", range(3))
def test_no_triangulation_costs_less(seed):
    corners = np.random.default_rng(seed).normal(size=(7, 3))
    least = min(cost(corners, triangles) for triangles in every_triangulation(0, 6))
    assert cost(corners, minimal_triangulation(corners)) == pytest.approx(least, rel=1e-12)


def test_a_concave_polygon_is_covered_once():
    x, y, _ = STAR.T
    enclosed = 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))
    triangles = minimal_triangulation(STAR)
    assert len(triangles) == 8
    assert area(STAR, triangles) == pytest.approx(enclosed)


def test_barred_diagonals_are_not_used():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    barred = np.zeros((4, 4), dtype=bool)
    barred[0, 2] = barred[2, 0] = True
    used = {frozenset(pair) for a, b, c in minimal_triangulation(square, barred).tolist() for pair in ((a, b), (b, c), (c, a))}
    assert frozenset({1, 3}) in used
    assert frozenset({0, 2}) not in used
    assert minimal_triangulation(square, np.ones((4, 4), dtype=bool)) is None


def test_fewer_than_three_corners_are_refused():
    with pytest.raises(ValueError, match="three corners; got 2"):
        minimal_triangulation(np.zeros((2, 3)))
