"""The triangle budget, and the depth of the reconstruction that it asks for."""

import pytest

from refmesh_addon.core.geometry.mesh import triangle_areas
from refmesh_addon.core.reference.budget import MAX_TRIANGLES, MIN_TRIANGLES, is_capped, triangle_budget
from refmesh_addon.core.surfacing.reconstruction import DEPTHS, reconstruction_depth

from ..shapes import ball, box, moved, torus


@pytest.mark.parametrize("mesh", [ball(), box(), torus()])
def test_depth_has_no_unit_and_grows_with_the_budget(mesh):
    budgets = [100, 1000, 5000, 20_000, 100_000, 1_000_000]
    depths = [reconstruction_depth(mesh, budget) for budget in budgets]
    assert depths == sorted(depths)
    assert depths[0] >= DEPTHS[0] and depths[-1] <= DEPTHS[1]
    assert len(set(depths)) > 3
    for change in ({"scale": 1e-3}, {"scale": 10.0}, {"shift": (1e3, 0.0, -1e3)}):
        assert [reconstruction_depth(moved(mesh, **change), budget) for budget in budgets] == depths


def test_depth_leaves_more_cells_on_the_surface_than_the_budget_but_not_many_more():
    mesh = ball(4)
    for budget in (5000, 20_000, 80_000):
        depth = reconstruction_depth(mesh, budget)
        cell = 1.1 * 2.0 / 2**depth
        expected = 2 * triangle_areas(mesh).sum() / cell**2
        assert budget < expected < 8 * budget


@pytest.mark.parametrize(
    "requested, captured, needed, expected, capped",
    [
        (0, [30_000, 50_000, 40_000], [90_000] * 3, 40_000, False),
        (0, [30_000, 50_000, 40_000], [3000] * 3, 40_000, False),
        (0, [600], [90_000], MIN_TRIANGLES, False),
        (0, [600], [3000], 3000, False),
        (0, [600], [90], 600, False),
        (600, [9], [90_000], 600, False),
        (0, [630_000], [90_000], MAX_TRIANGLES, True),
        (630_000, [630_000], [90_000], 630_000, False),
    ],
)
def test_triangles_are_as_many_as_requested_or_as_captured_but_enough_to_fit(requested, captured, needed, expected, capped):
    assert triangle_budget(requested, captured, needed) == expected
    assert is_capped(requested, captured) == capped


def test_a_layer_has_enough_triangles_for_each_of_its_sides():
    assert triangle_budget(0, [24_000], [850_000], sides=2) == 2 * MIN_TRIANGLES
    assert triangle_budget(0, [24_000], [40_000], sides=2) == 40_000
    assert triangle_budget(0, [90_000], [850_000], sides=2) == 90_000
