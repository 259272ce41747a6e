"""Key points belong to the shape: they move, turn and grow with it, and hardly depend on its triangles."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from refmesh_addon.core.deformation import keypoints
from refmesh_addon.core.deformation.keypoints import PUBLISHED_KEYPOINTS, KeypointSettings, find_keypoints, scatter_spectra
from refmesh_addon.core.geometry.mesh import mean_edge_length, merged, vertex_areas
from refmesh_addon.core.types import TriangleMesh

from .. import shapes


def hills(columns=61, rows=41, jitter=0.15, seed=1, squeeze=1.0):
    """A sheet with hills and hollows; the shape depends on nothing but the place, the vertices on `jitter` and `squeeze`."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, columns) ** squeeze * 3, np.linspace(0, 2, rows), indexing="ij")
    x[1:-1, 1:-1] += jitter * 0.03 * rng.normal(size=x[1:-1, 1:-1].shape)
    y[1:-1, 1:-1] += jitter * 0.03 * rng.normal(size=y[1:-1, 1:-1].shape)
    tops = np.random.default_rng(99).random((25, 4)) * [3, 2, 1, 1]
    z = sum((0.3 * a - 0.15) * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (0.01 + 0.03 * b)) for u, v, a, b in tops)
    index = np.arange(columns * rows).reshape(columns, rows)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], axis=2).reshape(-1, 3), np.stack([a, c, d], axis=2).reshape(-1, 3)])
    return TriangleMesh(np.stack([x, y, z], axis=2).reshape(-1, 3), triangles)


def slow_spectra(points, weights, radius):
    spectra, counts = [], []
    for point in points:
        near = np.linalg.norm(points - point, axis=1) <= radius
        scatter = sum(w * np.outer(q - point, q - point) for q, w in zip(points[near], weights[near]))
        spectra.append(np.linalg.eigvalsh(scatter / weights[near].sum())[::-1])
        counts.append(near.sum())
    return np.array(spectra), np.array(counts)


def slow_keypoints(mesh, length, settings):
    spectra, counts = slow_spectra(mesh.vertices, vertex_areas(mesh), settings.salient * length)
    fine = [
        c > settings.least_neighbors and b < settings.flatness * a and d < settings.flatness * b for (a, b, d), c in zip(spectra, counts)
    ]
    chosen = []
    for i in np.flatnonzero(fine):
        near = np.linalg.norm(mesh.vertices - mesh.vertices[i], axis=1) <= settings.suppression * length
        rivals = [j for j in np.flatnonzero(near & np.array(fine)) if j != i]
        if all(spectra[i, 2] > spectra[j, 2] or (spectra[i, 2] == spectra[j, 2] and i < j) for j in rivals):
            chosen.append(i)
    return np.array(chosen)


@pytest.mark.parametrize(
    "settings", [KeypointSettings(), KeypointSettings(salient=6.0, suppression=2.0, flatness=0.9, least_neighbors=40)]
)
def test_agrees_with_one_point_after_the_other(settings):
    mesh = hills(31, 21)
    length = mean_edge_length(mesh)
    fast = find_keypoints(mesh, length, settings)
    assert len(fast) > 5
    assert_array_equal(fast, slow_keypoints(mesh, length, settings))


def test_memory_blocks_change_nothing(monkeypatch):
    mesh = hills(31, 21)
    length = mean_edge_length(mesh)
    whole = find_keypoints(mesh, length)
    spectra, counts = scatter_spectra(mesh.vertices, vertex_areas(mesh), 4 * length)
    monkeypatch.setattr(keypoints, "BLOCK_PAIRS", 500)
    assert_array_equal(find_keypoints(mesh, length), whole)
    again, counts_again = scatter_spectra(mesh.vertices, vertex_areas(mesh), 4 * length)
    assert_allclose(again, spectra, rtol=1e-9, atol=1e-15)
    assert_array_equal(counts_again, counts)


@pytest.mark.parametrize("scale", [0.001, 1.0, 1000.0])
def test_moving_turning_and_scaling_keeps_the_key_points(scale):
    mesh = hills()
    turn, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    moved = mesh.moved(scale * (mesh.vertices @ turn.T + [10.0, -20.0, 5.0]))
    assert_array_equal(find_keypoints(moved, mean_edge_length(moved)), find_keypoints(mesh, mean_edge_length(mesh)))


def test_other_triangles_on_the_same_shape_give_nearly_the_same_key_points():
    even, uneven = hills(), hills(101, 61, seed=2, squeeze=1.5)
    length = mean_edge_length(even)
    ours, theirs = (mesh.vertices[find_keypoints(mesh, length)] for mesh in (even, uneven))
    inside = np.all((ours > 4 * length) & (ours < [3 - 4 * length, 2 - 4 * length, 9]) | (np.arange(3) == 2), axis=1)
    gaps = cKDTree(theirs).query(ours[inside])[0]
    assert inside.sum() > 10
    assert (gaps < 2 * length).mean() > 0.75


def test_no_two_key_points_within_the_suppression_radius():
    mesh = hills()
    length = mean_edge_length(mesh)
    chosen = mesh.vertices[find_keypoints(mesh, length)]
    assert len(chosen) > 10
    assert cKDTree(chosen).query(chosen, k=2)[0][:, 1].min() > KeypointSettings().suppression * length


def test_a_plane_has_no_key_points_of_its_own():
    mesh = hills()
    flat = mesh.moved(mesh.vertices * [1, 1, 0])
    spectra, _ = scatter_spectra(flat.vertices, vertex_areas(flat), 4 * mean_edge_length(flat))
    assert_allclose(spectra[:, 2], 0, atol=1e-12)


def test_a_surface_without_features_gives_the_published_search_no_key_points():
    """A ball and flat faces look alike around each of their points; the edges and corners of a box stay."""
    rng = np.random.default_rng(3)
    ball, box = shapes.ball(5, 1.0), shapes.box((2.0, 1.5, 1.0), 5)
    rough = [mesh.moved(mesh.vertices + 0.001 * rng.normal(size=mesh.vertices.shape)) for mesh in (ball, box)]
    plain = [find_keypoints(mesh, mean_edge_length(mesh)) for mesh in rough]
    kept = [find_keypoints(mesh, mean_edge_length(mesh), PUBLISHED_KEYPOINTS) for mesh in rough]
    assert len(plain[0]) > 100 and len(kept[0]) == 0
    inside = np.sort([1.0, 0.75, 0.5] - np.abs(rough[1].vertices), axis=1)[:, 1]  # distance from the nearest edge of the box, about
    length = mean_edge_length(rough[1])
    assert (inside[plain[1]] > 4 * length).sum() > 20
    assert len(kept[1]) >= 8 and (inside[kept[1]] < 4 * length).all()


def test_bad_lengths_are_refused_and_nothing_gives_nothing():
    with pytest.raises(ValueError, match="length"):
        find_keypoints(hills(5, 5), 0.0)
    assert len(find_keypoints(TriangleMesh(np.empty((0, 3)), np.empty((0, 3))), 1.0)) == 0


def test_key_points_of_a_real_body_come_again_in_the_next_frame(shared_data):
    trimesh = pytest.importorskip("trimesh")
    meshes = []
    for number in (6, 7):
        raw = trimesh.load(shared_data("dancer") / f"dancer_fr{number:04d}.obj", process=False)
        meshes.append(merged(TriangleMesh(raw.vertices, raw.faces))[0])
    length = mean_edge_length(meshes[0])
    found = [mesh.vertices[find_keypoints(mesh, length)] for mesh in meshes]
    gaps = cKDTree(found[1]).query(found[0])[0]
    assert 100 < len(found[0]) < 1000
    assert (gaps < 3 * length).mean() > 0.6  # the body moves by about an edge length between the two frames


def test_a_dense_mesh_has_key_points_where_the_coarse_one_has_them():
    """One vertex in each cell is looked at, so that the pairs do not grow with the square of the density."""
    coarse, dense = hills(), hills(301, 201)
    length = mean_edge_length(coarse)
    thinned, areas = keypoints._thinned(dense, length)
    assert len(thinned) < 3 * len(coarse.vertices) and (np.diff(thinned) > 0).all()
    assert_allclose(areas.sum(), vertex_areas(dense).sum())
    assert_array_equal(keypoints._thinned(coarse, length)[0], np.arange(len(coarse.vertices)))
    ours, theirs = coarse.vertices[find_keypoints(coarse, length)], dense.vertices[find_keypoints(dense, length)]
    inside = np.all((ours > 4 * length) & (ours < [3 - 4 * length, 2 - 4 * length, 9]) | (np.arange(3) == 2), axis=1)
    assert inside.sum() > 5
    assert (cKDTree(theirs).query(ours[inside])[0] < 2 * length).mean() > 0.7
