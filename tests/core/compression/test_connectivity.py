import numpy as np
import pytest

from refmesh_addon.core.compression.connectivity import decoded_triangles, encoded_triangles
from tests.core import shapes
from tests.core.compression.recording import Player, Recorder


def returned(triangles, count):
    """What a decoder gets, in the old numbers of vertices, and the recorder."""
    recorder = Recorder()
    coded, order = encoded_triangles(recorder, np.asarray(triangles), count)
    decoded = decoded_triangles(Player(recorder), len(triangles), count)
    np.testing.assert_array_equal(decoded, coded)
    assert sorted(order) == list(range(count))
    return order[decoded], recorder


def as_set(triangles):
    """Triangles as a sorted list in which the first corner is the lowest, so that orientation counts and nothing else does."""
    rows = np.asarray(triangles)
    first = rows.argmin(axis=1)
    turned = rows[np.arange(len(rows))[:, None], (first[:, None] + np.arange(3)) % 3]
    return sorted(map(tuple, turned.tolist()))


MESHES = {
    "ball": shapes.ball(2),
    "torus": shapes.torus(),
    "box": shapes.box(subdivisions=1),
    "two bodies": shapes.joined(shapes.ball(1), shapes.ball(1, center=(5.0, 0.0, 0.0))),
}


@pytest.mark.parametrize("name", MESHES)
def test_closed_meshes_come_back_with_their_orientation(name):
    mesh = MESHES[name]
    triangles, _ = returned(mesh.triangles, len(mesh.vertices))
    assert as_set(triangles) == as_set(mesh.triangles)


def test_an_open_mesh_with_holes_comes_back():
    mesh = shapes.ball(2)
    kept = mesh.triangles[np.random.default_rng(3).random(len(mesh.triangles)) < 0.7]
    triangles, _ = returned(kept, len(mesh.vertices))
    assert as_set(triangles) == as_set(kept)


@pytest.mark.parametrize("seed", range(20))
def test_any_list_of_triangles_comes_back(seed):
    """Edges with many triangles, triangles that occur twice, both orientations, vertices that no triangle has."""
    rng = np.random.default_rng(seed)
    triangles = np.array([rng.choice(12, 3, replace=False) for _ in range(30)])
    decoded, _ = returned(np.concatenate([triangles, triangles[:3]]), 14)
    assert as_set(decoded) == as_set(np.concatenate([triangles, triangles[:3]]))


def test_a_smooth_closed_mesh_needs_about_one_symbol_for_each_triangle():
    mesh = shapes.ball(4)
    _, recorder = returned(mesh.triangles, len(mesh.vertices))
    assert len(recorder.steps) < 1.02 * len(mesh.triangles)


def test_more_vertices_than_declared_are_refused():
    recorder = Recorder()
    mesh = shapes.ball(1)
    encoded_triangles(recorder, mesh.triangles, len(mesh.vertices))
    with pytest.raises(ValueError, match="more vertices than declared"):
        decoded_triangles(Player(recorder), len(mesh.triangles), len(mesh.vertices) - 1)
