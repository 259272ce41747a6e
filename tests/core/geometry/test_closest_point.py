"""Closest points agree with trying every triangle, on kind and unkind meshes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import ConvexHull

from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.types import TriangleMesh

TINY = np.finfo(float).tiny


def slow_closest(mesh, point):
    """Each triangle in turn: the projection where it falls inside, else the nearest point of its edges."""
    best, best_distance = None, np.inf
    for corners in mesh.vertices[mesh.triangles]:
        candidates = []
        for start, end in zip(corners, np.roll(corners, -1, axis=0)):
            run = end - start
            share = np.clip((point - start) @ run / (run @ run), 0, 1) if run @ run > 0 else 0.0
            candidates.append(start + share * run)
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        foot = point - ((point - corners[0]) @ normal) / max(normal @ normal, TINY) * normal
        if normal.any() and all(np.cross(end - start, foot - start) @ normal >= 0 for start, end in zip(corners, np.roll(corners, -1, 0))):
            candidates.append(foot)
        for candidate in candidates:
            if np.linalg.norm(point - candidate) < best_distance:
                best, best_distance = candidate, np.linalg.norm(point - candidate)
    return best, best_distance


def on_triangle(corners, points):
    """How far each of (N, 3) points lies from being a convex combination of its (N, 3, 3) triangle's corners."""
    rows = []
    for triangle, point in zip(corners, points):
        system = np.vstack([triangle.T / np.ptp(triangle), np.ones(3)])
        weights = np.linalg.lstsq(system, np.append(point / np.ptp(triangle), 1.0), rcond=None)[0]
        rows.append(max(-weights.min(), np.abs(system @ weights - np.append(point / np.ptp(triangle), 1.0)).max()))
    return np.array(rows)


def soup(rng, count, size=0.2):
    """Unrelated triangles of many shapes."""
    corners = rng.random((count, 1, 3)) + size * rng.normal(size=(count, 3, 3)) * rng.random((count, 1, 1))
    return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def unkind(rng):
    """Slivers, points, segments, doubled triangles and one triangle a thousand times the others."""
    mesh = soup(rng, 60)
    vertices = mesh.vertices.copy()
    vertices[3:6] = vertices[3]
    vertices[8] = (vertices[6] + vertices[7]) / 2
    vertices[11] = vertices[9] + 1e-9 * rng.normal(size=3)
    vertices[12:15] = 200 * np.array([[-1, -1, -0.002], [1.5, -1, -0.002], [-1, 1.5, 0.001]])
    vertices[15:18] = [[-50, 0.5, 0.5], [50, 0.5, 0.5], [0, 0.5, 0.5001]]
    return TriangleMesh(vertices, np.vstack([mesh.triangles, mesh.triangles[20:30], mesh.triangles[30:40, ::-1]]))


@pytest.mark.parametrize("make", [lambda rng: soup(rng, 80), lambda rng: soup(rng, 1), unkind])
@pytest.mark.parametrize("spread", [0.3, 3.0, 1000.0])
def test_agrees_with_every_triangle_tried(make, spread):
    rng = np.random.default_rng(3)
    mesh = make(rng)
    queries = 0.5 + spread * rng.normal(size=(15, 3))
    result = SurfaceIndex(mesh).query(queries)
    slow = [slow_closest(mesh, query) for query in queries]
    assert_allclose(result.distances, [distance for _, distance in slow], rtol=1e-9, atol=1e-12)
    assert_allclose(np.linalg.norm(result.points - queries, axis=1), result.distances, rtol=1e-12, atol=1e-12)
    measured = mesh.vertices[mesh.triangles[result.triangles]]
    proper = np.ptp(measured, axis=1).max(axis=1) > 0
    assert on_triangle(measured[proper], result.points[proper]).max() < 1e-7


def sphere(count=24):
    """A closed ball of radius one, with very small triangles at its poles."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, count), np.linspace(0, 2 * np.pi, 2 * count, endpoint=False), indexing="ij")
    vertices = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=2).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(count - 1), np.arange(2 * count), indexing="ij")
    a, b = row * 2 * count + column, row * 2 * count + (column + 1) % (2 * count)
    c, d = a + 2 * count, b + 2 * count
    return TriangleMesh(vertices, np.concatenate([np.stack([a, c, b], axis=2), np.stack([b, c, d], axis=2)]).reshape(-1, 3))


def test_corners_edges_and_faces_lie_on_the_surface():
    mesh = sphere()
    corners = mesh.vertices[mesh.triangles]
    on_surface = np.concatenate([mesh.vertices, corners[:, :2].mean(axis=1), corners.mean(axis=1)])
    result = SurfaceIndex(mesh).query(on_surface)
    assert_allclose(result.distances, 0, atol=1e-15)
    assert_allclose(result.points, on_surface, atol=1e-15)


def test_the_middle_of_a_ball_is_equally_far_from_many_triangles():
    mesh = sphere()
    centers = mesh.vertices[mesh.triangles].mean(axis=1)
    result = SurfaceIndex(mesh).query(np.zeros((5, 3)))
    slow = slow_closest(mesh, np.zeros(3))[1]
    assert_allclose(result.distances, slow, rtol=1e-12)
    assert slow <= np.linalg.norm(centers, axis=1).min()
    assert len(np.unique(result.triangles)) == 1


def test_moving_and_scaling_moves_and_scales_the_answer():
    rng = np.random.default_rng(5)
    mesh, queries = unkind(rng), rng.normal(size=(200, 3))
    plain = SurfaceIndex(mesh).query(queries)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    shift = np.array([1e4, -2e4, 5e3])
    moved = SurfaceIndex(mesh.moved(1000 * mesh.vertices @ q.T + shift)).query(1000 * queries @ q.T + shift)
    assert_allclose(moved.distances, 1000 * plain.distances, rtol=1e-7, atol=1e-6)


@pytest.mark.parametrize("size", [1.0, 0.6045155352799262, 0.3056069420988995, 0.8053751950637755, 0.08592948793264976])
def test_the_largest_triangle_may_have_any_size(size):
    """Its sphere, whose radius is the size, is lifted by nothing: some numbers have squares that depend on how they are taken."""
    vertices = size * np.array([[-1.0, 0, 0], [1, 0, 0], [0, 0.5, 0], [0, -0.5, 0]])
    found = SurfaceIndex(TriangleMesh(vertices, [[0, 1, 2], [1, 0, 3]])).query([[0, 0.2 * size, 1], [0, -0.2 * size, 1]])
    assert_array_equal(found.triangles, [0, 1])
    assert_allclose(found.distances, 1.0)


def test_every_query_is_answered_on_its_own():
    rng = np.random.default_rng(7)
    mesh, queries = sphere(), rng.normal(size=(40_000, 3))
    index = SurfaceIndex(mesh)
    whole, part = index.query(queries), index.query(queries[17::131])
    assert_array_equal(whole.distances[17::131], part.distances)
    assert_array_equal(whole.triangles[17::131], part.triangles)
    assert_array_equal(whole.points[17::131], part.points)


def test_beyond_the_greatest_distance_nothing_is_found():
    rng = np.random.default_rng(9)
    mesh, queries = sphere(), 1.5 * rng.normal(size=(2000, 3))
    index = SurfaceIndex(mesh)
    free, bound = index.query(queries), index.query(queries, max_distance=0.4)
    near = free.distances < 0.4
    assert near.any() and not near.all()
    assert_array_equal(bound.distances[near], free.distances[near])
    assert_array_equal(bound.triangles[near], free.triangles[near])
    assert np.isinf(bound.distances[~near]).all() and (bound.triangles[~near] == -1).all()
    assert_array_equal(bound.points[~near], queries[~near])


def test_no_queries_give_empty_arrays_and_no_triangles_are_refused():
    assert SurfaceIndex(sphere()).query(np.empty((0, 3))).points.shape == (0, 3)
    with pytest.raises(ValueError, match="no triangles"):
        SurfaceIndex(TriangleMesh(np.zeros((3, 3)), np.empty((0, 3))))


@pytest.mark.parametrize(("scale", "shift"), [(1e-3, 0.0), (10.0, 0.0), (1.0, 20.0)])
def test_a_point_nearest_to_an_edge_has_the_same_triangle_in_any_unit(scale, shift):
    """Both triangles of an edge are equally far; rounding must not choose, because their normals differ."""
    rng = np.random.default_rng(0)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) + 0.05 * rng.normal(size=(8, 3))
    hull = ConvexHull(corners)
    points = rng.normal(size=(3000, 3)) + 0.5
    found = [
        SurfaceIndex(TriangleMesh(s * corners + t, hull.simplices)).query(s * points + t).triangles for s, t in ((1.0, 0.0), (scale, shift))
    ]
    np.testing.assert_array_equal(found[1], found[0])
