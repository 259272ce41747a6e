from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry.self_intersection import crossing_triangles, still_crossing
from refmesh_addon.core.types import TriangleMesh

from ..bodies import BODIES


def slow_twin(mesh):
    """Every pair of triangles, each edge of the one against the other."""
    crossing = np.zeros(len(mesh.triangles), bool)
    for one, other in combinations(range(len(mesh.triangles)), 2):
        for edges, face in ((one, other), (other, one)):
            corners = mesh.triangles[edges]
            for start, end in zip(corners, np.roll(corners, -1)):
                if start in mesh.triangles[face] or end in mesh.triangles[face]:
                    continue
                a, b, c = mesh.vertices[mesh.triangles[face]]
                matrix = np.column_stack([b - a, c - a, mesh.vertices[start] - mesh.vertices[end]])
                if abs(np.linalg.det(matrix)) < 1e-12:
                    continue
                u, v, t = np.linalg.solve(matrix, mesh.vertices[start] - a)
                if u >= 0 and v >= 0 and u + v <= 1 and 0 < t < 1:
                    crossing[[one, other]] = True
    return crossing


@pytest.mark.parametrize("seed", range(3))
def test_the_same_as_trying_every_pair(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(24, 3)) * rng.choice([0.2, 1.0, 3.0], size=(24, 1))  # short and long edges
    triangles = np.array([rng.choice(24, 3, replace=False) for _ in range(20)])
    mesh = TriangleMesh(vertices, triangles)
    expected = slow_twin(mesh)
    assert expected.any() and not expected.all()
    assert_array_equal(crossing_triangles(mesh), expected)


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES.keys())
def test_a_sound_surface_has_none(body):
    assert not crossing_triangles(body).any()


@pytest.mark.parametrize(("shift", "crossed"), [(1.0, True), (2.5, False), (0.001, True)])
def test_two_balls_cross_where_they_overlap(shift, crossed):
    ball = BODIES["ball"]
    both = TriangleMesh(
        np.vstack([ball.vertices, ball.vertices + [shift, 0.1, 0]]), np.vstack([ball.triangles, ball.triangles + len(ball.vertices)])
    )
    result = crossing_triangles(both)
    assert result.any() == crossed
    if shift == 1.0:
        centroids = both.vertices[both.triangles[result]].mean(axis=1)
        assert np.abs(centroids[:, 0] - 0.5).max() < 0.3  # near the plane between the balls


def test_a_pierced_triangle_and_what_pierces_it_both_count():
    vertices = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, -1], [1.1, 1, 1], [1, 1.1, 1], [9, 9, 9]])
    mesh = TriangleMesh(vertices, np.array([[0, 1, 2], [3, 4, 5], [1, 2, 6]]))
    assert_array_equal(crossing_triangles(mesh), [True, True, False])


@pytest.mark.parametrize("seed", range(3))
def test_what_still_crosses_is_found_near_what_changed(seed):
    rng = np.random.default_rng(seed)
    sheets = [np.column_stack([*rng.uniform(0, 4, (2, 60)), np.full(60, 0.3 * level)]) for level in range(6)]
    corners = np.concatenate(sheets)[:, None] + rng.uniform(-0.15, 0.15, (360, 3, 3)) * [1, 1, 0]
    corners[::15] += [0, 0, 0.7] * rng.uniform(-1, 1, (24, 3, 1))  # these alone leave their sheet
    mesh = TriangleMesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    changed = np.zeros(len(corners), bool)
    changed[::15] = True
    expected = crossing_triangles(mesh)
    assert expected.any()
    assert_array_equal(still_crossing(mesh, changed), expected)
    assert not still_crossing(mesh, np.zeros(len(corners), bool)).any()
