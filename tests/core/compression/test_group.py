import numpy as np
import pytest

from refmesh_addon.core.compression.group import STEP, decoded_group
from refmesh_addon.core.compression.group_encoder import MARGIN, Balance, encoded_group
from refmesh_addon.core.compression.surface_frames import SCALE, along_frames, from_frames, surface_frames
from tests.core import shapes
from tests.core.compression.recording import Player, Recorder

BALANCE = Balance(nodes=30)


def bending(mesh, frames):
    """(F, V, 3): the mesh bends, more from frame to frame."""
    x, y, z = mesh.vertices.T
    return np.stack([np.stack([x, y + 0.03 * f * x**2, z + 0.02 * f * np.sin(2 * x)], axis=1) for f in range(frames)])


def on_grid(frames, unit):
    return (frames - frames.min(axis=(0, 1))) / unit + MARGIN


def coded(frames, triangles, balance=BALANCE):
    recorder = Recorder()
    shape, mesh, order = encoded_group(recorder, frames, triangles, balance)
    return shape, mesh, order, recorder


@pytest.fixture(scope="module")
def group():
    mesh = shapes.torus()
    return on_grid(bending(mesh, 5), 1e-4), mesh.triangles


def test_a_decoder_gets_what_the_encoder_saw(group):
    shape, mesh, _, recorder = coded(*group)
    decoded = decoded_group(Player(recorder), shape)
    np.testing.assert_array_equal(decoded.points, mesh.points)
    np.testing.assert_array_equal(decoded.triangles, mesh.triangles)


def test_errors_along_normals_stay_near_the_step(group):
    frames, triangles = group
    _, mesh, order, _ = coded(frames, triangles)
    error = mesh.points - frames[:, order]
    for frame, difference in zip(frames[:, order], error):
        normals = surface_frames(mesh.triangles, np.rint(frame), np.arange(len(frame)))[0] / SCALE
        assert np.sqrt(((difference * normals).sum(axis=1) ** 2).mean()) < 0.6 * STEP
    assert np.abs(error).max() < 12 * STEP


def test_halving_the_grid_halves_the_error():
    mesh = shapes.torus()
    errors = []
    for unit in (2e-4, 1e-4):
        frames = on_grid(bending(mesh, 4), unit)
        _, decoded, order, _ = coded(frames, mesh.triangles)
        errors.append(unit * np.abs(decoded.points - frames[:, order]).mean())
    assert 0.35 < errors[1] / errors[0] < 0.7


def test_a_mesh_that_stands_still_is_coded_once():
    mesh = shapes.torus()
    shape, decoded, _, _ = coded(on_grid(np.repeat(mesh.vertices[None], 7, axis=0), 1e-4), mesh.triangles)
    assert shape.nodes == 0 and shape.frames == 7
    assert (decoded.points == decoded.points[0]).all()


def test_one_frame():
    mesh = shapes.ball(3)
    shape, decoded, _, recorder = coded(on_grid(mesh.vertices[None], 1e-4), mesh.triangles)
    np.testing.assert_array_equal(decoded_group(Player(recorder), shape).points, decoded.points)


def test_loose_bodies_and_vertices_are_kept():
    mesh = shapes.joined(shapes.ball(2), shapes.ball(1, 0.2, (2.0, 0.0, 0.0)), shapes.ball(1, 0.2, (-2.0, 0.0, 0.0)))
    points = np.vstack([mesh.vertices, [[0.0, 0.0, 3.0]]])
    frames = on_grid(np.stack([points + [0.1 * f, 0.0, 0.0] for f in range(3)]), 1e-4)
    shape, decoded, order, recorder = coded(frames, mesh.triangles, Balance(nodes=2))
    np.testing.assert_array_equal(decoded_group(Player(recorder), shape).points, decoded.points)
    assert np.abs(decoded.points - frames[:, order]).max() < 20 * STEP


def test_frames_are_square_and_the_way_back_from_components():
    mesh = shapes.ball(2)
    axes = surface_frames(mesh.triangles.astype(np.int64), np.rint(1e4 * mesh.vertices), np.arange(len(mesh.vertices)))
    products = np.einsum("anc,bnc->nab", axes, axes) / SCALE**2
    np.testing.assert_allclose(products, np.broadcast_to(np.eye(3), products.shape), atol=2e-3)
    assert ((axes[0] * mesh.vertices).sum(axis=1) > 0.95 * SCALE).all()
    vectors = np.random.default_rng(2).integers(-500, 500, (len(mesh.vertices), 3)).astype(float)
    assert np.abs(from_frames(axes, along_frames(axes, vectors)) - vectors).max() < 4
