import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry.mesh import is_watertight, signed_volume, vertex_components
from refmesh_addon.core.surfacing.dual_marching_cubes import zero_surface
from refmesh_addon.core.surfacing.sparse_grid import whole_grid


@pytest.fixture
def grid():
    return whole_grid(np.array([-1.0, 2.0, 5.0]), 0.25, (8, 6, 5))


def linear(points):
    return points @ [0.3, -1.2, 0.7] + 0.5


def node_places(grid):
    return grid.origin + grid.cell * grid.coordinates(grid.nodes)


def test_interpolation_and_slope_are_exact_for_linear_functions(grid):
    values = linear(node_places(grid))
    points = grid.origin + np.random.default_rng(0).random((100, 3)) * np.array(grid.shape) * grid.cell
    assert_allclose(grid.interpolation(points) @ values, linear(points))
    keys, inside = grid.cells_of(points)
    value, slope = grid.value_and_gradient(values, np.searchsorted(grid.cells, keys), inside)
    assert_allclose(value, linear(points))
    assert_allclose(slope / grid.cell, np.tile([0.3, -1.2, 0.7], (100, 1)))


def test_slope_agrees_with_differences(grid):
    rng = np.random.default_rng(0)
    values, inside = rng.normal(size=len(grid.nodes)), rng.uniform(0.1, 0.9, (50, 3))
    cells = rng.integers(len(grid.cells), size=50)
    _, slope = grid.value_and_gradient(values, cells, inside)
    for axis in range(3):
        step = 1e-6 * np.eye(3)[axis]
        difference = grid.value_and_gradient(values, cells, inside + step)[0] - grid.value_and_gradient(values, cells, inside - step)[0]
        assert_allclose(slope[:, axis], difference / 2e-6, atol=1e-8)


def test_a_refined_grid_carries_the_same_function(grid):
    values = np.random.default_rng(0).normal(size=len(grid.nodes))
    fine = grid.refined(grid.cells[::3])
    points = fine.origin + fine.cell * (fine.coordinates(fine.cells) + 0.3)
    assert_allclose(fine.interpolation(points) @ grid.prolonged(values, fine), grid.interpolation(points) @ values)


def test_dilation_reaches_all_neighbors_and_stays_in_the_grid(grid):
    corner, middle = grid.keys(np.array([[0, 0, 0]])), grid.keys(np.array([[4, 3, 2]]))
    assert len(grid.dilated(corner)) == 8
    assert len(grid.dilated(middle)) == 27
    assert_array_equal(grid.dilated(grid.dilated(middle)), grid.dilated(middle, 2))


def test_points_outside_the_cells_are_refused(grid):
    some = grid.refined(grid.cells[:1])
    with pytest.raises(ValueError, match="must lie in cells"):
        some.interpolation(np.array([[0.9, 3.4, 6.2]]))


def test_any_signs_give_a_closed_manifold():
    """Noise has every pattern of corners; its surface is closed with each edge shared by two triangles."""
    grid = whole_grid(np.zeros(3), 1.0, (12, 12, 12))
    values = np.random.default_rng(3).normal(size=len(grid.nodes))
    places = grid.coordinates(grid.nodes)
    values[((places == 0) | (places == 12)).any(axis=1)] = -1.0
    assert is_watertight(zero_surface(grid, values))


def test_the_surface_of_a_distance_is_a_ball():
    grid = whole_grid(np.full(3, -1.5), 0.1, (30, 30, 30))
    result = zero_surface(grid, 1.0 - np.linalg.norm(node_places(grid), axis=1))
    assert is_watertight(result) and vertex_components(result)[0] == 1
    assert signed_volume(result) == pytest.approx(4 / 3 * np.pi, rel=0.01)
    assert np.abs(np.linalg.norm(result.vertices, axis=1) - 1).max() < 0.01
