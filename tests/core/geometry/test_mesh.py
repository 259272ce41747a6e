"""Areas, normals, merging, components and sampling obey their laws."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry import mesh as geometry
from refmesh_addon.core.geometry.half_edges import HalfEdges
from refmesh_addon.core.types import TriangleMesh


def cube(side=2.0, at=(0.0, 0.0, 0.0)):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [triangle for a, b, c, d in quads for triangle in ([a, b, c], [a, c, d])]
    return TriangleMesh(side * corners + at, triangles)


def apart(mesh):
    """Every triangle with corners of its own, as along UV seams."""
    return TriangleMesh(mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(3 * len(mesh.triangles)).reshape(-1, 3))


def joined(a, b):
    return TriangleMesh(np.concatenate([a.vertices, b.vertices]), np.concatenate([a.triangles, b.triangles + len(a.vertices)]))


def test_a_cube_has_the_area_volume_and_normals_of_a_cube():
    mesh = cube(2.0, at=(1e5, -3.0, 7.0))
    assert_allclose(geometry.triangle_areas(mesh).sum(), 24)
    assert_allclose(geometry.vertex_areas(mesh).sum(), 24)
    assert_allclose(geometry.signed_volume(mesh), 8)
    assert_allclose(geometry.signed_volume(TriangleMesh(mesh.vertices, mesh.triangles[:, ::-1])), -8)
    centers = mesh.vertices[mesh.triangles].mean(axis=1) - mesh.vertices.mean(axis=0)
    assert (np.einsum("ij,ij->i", geometry.triangle_normals(mesh), centers) > 0).all()
    assert (np.einsum("ij,ij->i", geometry.vertex_normals(mesh), mesh.vertices - mesh.vertices.mean(axis=0)) > 0).all()
    assert len(HalfEdges.of(mesh).edges) == 18  # Euler: V - E + T = 2
    assert_allclose(geometry.mean_edge_length(mesh), (12 * 2 + 6 * 2 * np.sqrt(2)) / 18)


def test_area_vectors_of_a_closed_surface_cancel():
    assert_allclose(geometry.area_vectors(cube()).sum(axis=0), 0, atol=1e-15)


def test_degenerate_triangles_have_no_normal_and_no_area():
    mesh = TriangleMesh(np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 5, 5]]), [[0, 1, 2], [0, 0, 1]])
    assert_array_equal(geometry.triangle_normals(mesh), 0)
    assert_array_equal(geometry.vertex_normals(mesh), 0)
    assert_array_equal(geometry.triangle_areas(mesh), 0)


def test_turning_a_mesh_turns_its_normals():
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    mesh = cube()
    moved = mesh.moved(3 * mesh.vertices @ turn.T + 1)
    assert_allclose(geometry.vertex_normals(moved), geometry.vertex_normals(mesh) @ turn.T, atol=1e-12)
    assert_allclose(geometry.vertex_areas(moved), 9 * geometry.vertex_areas(mesh))


def test_watertight_means_every_edge_twice_in_opposite_directions():
    mesh = cube()
    flipped = mesh.triangles.copy()
    flipped[0] = flipped[0, ::-1]
    assert geometry.is_watertight(mesh)
    assert geometry.is_watertight(joined(mesh, cube(at=(9, 9, 9))))
    assert not geometry.is_watertight(TriangleMesh(mesh.vertices, mesh.triangles[1:]))
    assert not geometry.is_watertight(TriangleMesh(mesh.vertices, flipped))
    assert not geometry.is_watertight(TriangleMesh(mesh.vertices, np.concatenate([mesh.triangles, mesh.triangles])))
    assert not geometry.is_watertight(apart(mesh))
    assert not geometry.is_watertight(TriangleMesh(mesh.vertices, np.empty((0, 3))))


def test_distinct_points_are_those_of_a_plain_search_through_the_rows():
    points = np.round(np.random.default_rng(4).normal(size=(400, 3)), 1)
    points[::7] *= -0.0
    for some in (points, points[:1], points[:0]):
        _, first, place = np.unique(some, axis=0, return_index=True, return_inverse=True)
        result = geometry.unique_points(some)
        assert_array_equal(result[0], first)
        assert_array_equal(result[1], place.reshape(-1))


def test_merging_closes_seams_and_a_second_time_changes_nothing():
    mesh = cube()
    once, kept = geometry.merged(apart(mesh))
    twice, kept_again = geometry.merged(once)
    assert geometry.is_watertight(once)
    assert len(once.vertices) == 8
    assert_array_equal(once.vertices, apart(mesh).vertices[kept])
    assert_array_equal(once.vertices[once.triangles], mesh.vertices[mesh.triangles])
    assert_array_equal(twice.vertices, once.vertices)
    assert_array_equal(twice.triangles, once.triangles)
    assert_array_equal(kept_again, np.arange(8))


def test_merging_drops_what_collapses_and_what_is_unused():
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [7, 7, 7]], [[0, 1, 2], [0, 1, 3], [3, 1, 1]])
    once, _ = geometry.merged(mesh)
    assert len(once.vertices) == 3
    assert len(once.triangles) == 1


def test_a_submesh_keeps_its_triangles_in_their_places_and_drops_the_other_vertices():
    mesh = joined(cube(), cube(at=(5, 0, 0)))
    chosen = np.random.default_rng(6).random(len(mesh.triangles)) < 0.3
    for triangles in (chosen, np.flatnonzero(chosen), slice(3, 9), slice(0)):
        part, used = geometry.submesh(mesh, triangles)
        assert_array_equal(used, np.unique(mesh.triangles[triangles]))
        assert_array_equal(part.vertices, mesh.vertices[used])
        assert_array_equal(used[part.triangles], mesh.triangles[triangles])


def test_the_whole_as_a_submesh_only_loses_unused_vertices():
    mesh = TriangleMesh(np.concatenate([[[7, 7, 7]], cube().vertices]), cube().triangles + 1)
    whole, used = geometry.submesh(mesh)
    assert_array_equal(used, np.arange(1, 9))
    assert_array_equal(whole.vertices, cube().vertices)
    assert_array_equal(whole.triangles, cube().triangles)


def test_components_of_two_bodies_and_a_lone_vertex():
    mesh = joined(cube(), cube(at=(5, 0, 0)))
    mesh = TriangleMesh(np.concatenate([mesh.vertices, [[9, 9, 9]]]), mesh.triangles)
    count, labels = geometry.vertex_components(mesh)
    assert count == 3
    assert len(set(labels[:8])) == len(set(labels[8:16])) == 1
    assert len({labels[0], labels[8], labels[16]}) == 3


def test_samples_fall_on_triangles_in_proportion_to_their_area():
    rng = np.random.default_rng(2)
    corners = rng.normal(size=(12, 3, 3)) * rng.random((12, 1, 1)) * 3
    mesh = TriangleMesh(corners.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    count = 60_000
    points, triangles = geometry.sample_surface(mesh, count, rng)
    share = geometry.triangle_areas(mesh) / geometry.triangle_areas(mesh).sum()
    spread = np.sqrt(share * (1 - share) / count)
    assert (np.abs(np.bincount(triangles, minlength=12) / count - share) < 5 * spread).all()
    for index in range(12):
        of_triangle = points[triangles == index]
        a, b, c = corners[index]
        weights = np.linalg.lstsq(np.stack([b - a, c - a], axis=1), (of_triangle - a).T, rcond=None)[0]
        assert weights.min() > -1e-9 and weights.sum(axis=0).max() < 1 + 1e-9
        assert_allclose(a + weights.T @ np.stack([b - a, c - a]), of_triangle, atol=1e-9)
        # evenly within a triangle too: both weights are a third in the mean, standard deviation 1 / sqrt(18)
        assert np.abs(weights.mean(axis=1) - 1 / 3).max() < 5 / np.sqrt(18 * len(of_triangle))


def test_sampling_never_picks_a_triangle_without_area_and_refuses_none_at_all():
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 1], [0, 1, 2], [2, 2, 2]])
    assert (geometry.sample_surface(mesh, 1000, np.random.default_rng(0))[1] == 1).all()
    with pytest.raises(ValueError, match="no area"):
        geometry.sample_surface(TriangleMesh(np.zeros((3, 3)), [[0, 1, 2]]), 10, np.random.default_rng(0))
