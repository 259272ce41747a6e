import numpy as np
import pytest

from refmesh_addon.core.compression.hierarchy import COARSEST, neighbors, vertex_hierarchy
from refmesh_addon.core.compression.interpolation import interpolated, stencil
from tests.core import shapes


@pytest.fixture(scope="module")
def ball():
    return shapes.ball(4)


def test_every_vertex_has_one_level_and_no_neighbor_in_it(ball):
    hierarchy = vertex_hierarchy(ball.triangles, len(ball.vertices))
    every = np.concatenate([hierarchy.coarsest, *(level.fine for level in hierarchy.levels)])
    assert sorted(every) == list(range(len(ball.vertices)))
    assert len(hierarchy.coarsest) <= COARSEST
    for level in hierarchy.levels:
        assert level.adjacency[level.fine][:, level.fine].nnz == 0


def test_a_coarser_level_has_the_other_vertices_of_the_finer_one(ball):
    levels = vertex_hierarchy(ball.triangles, len(ball.vertices)).levels
    for coarse, fine in zip(levels, levels[1:]):
        assert set(np.unique(coarse.triangles)) == set(np.unique(fine.triangles)) - set(fine.fine)


def test_vertices_without_triangles_are_on_the_coarsest_level():
    hierarchy = vertex_hierarchy(shapes.ball(3).triangles, 700)
    assert set(range(642, 700)) <= set(hierarchy.coarsest)


@pytest.mark.parametrize("triangles", [[[0, 1, 2]], [[0, 1, 2], [0, 2, 1]], np.zeros((0, 3), dtype=int)])
def test_tiny_meshes_end(triangles):
    hierarchy = vertex_hierarchy(np.asarray(triangles), 80)
    assert sum(len(level.fine) for level in hierarchy.levels) + len(hierarchy.coarsest) == 80


def test_neighbors_are_the_edges():
    table = neighbors(np.array([[0, 1, 2], [2, 1, 3]]), 5).toarray()
    np.testing.assert_array_equal(table.astype(int), [[0, 1, 1, 0, 0], [1, 0, 1, 1, 0], [1, 1, 0, 1, 0], [0, 1, 1, 0, 0], [0, 0, 0, 0, 0]])


def test_interpolation_solves_its_equations_to_a_unit(ball):
    """The twin solves the least-squares problem of the level, with what is known held fast, by a dense solver."""
    level = vertex_hierarchy(ball.triangles, len(ball.vertices)).levels[-6]
    equations = stencil(level)
    points = np.rint(1000 * ball.vertices)
    energy = equations.energy.toarray()
    known = np.setdiff1d(np.arange(len(points)), level.fine)
    exact = np.linalg.solve(energy[:, level.fine], -energy[:, known] @ points[known])
    assert np.abs(interpolated(equations, points) - exact).max() < 12  # steps end at 0.4^5 of the way; rounding adds a unit


def test_interpolation_gives_whole_numbers_and_leaves_its_input(ball):
    level = vertex_hierarchy(ball.triangles, len(ball.vertices)).levels[-1]
    points = np.rint(1000 * ball.vertices)
    before = points.copy()
    result = interpolated(stencil(level), points)
    np.testing.assert_array_equal(result, np.rint(result))
    np.testing.assert_array_equal(points, before)


def test_a_constant_is_interpolated_exactly(ball):
    level = vertex_hierarchy(ball.triangles, len(ball.vertices)).levels[-1]
    values = np.full((len(ball.vertices), 2), 12345.0)
    np.testing.assert_array_equal(interpolated(stencil(level), values), 12345.0)
