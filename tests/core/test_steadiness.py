"""Sliding along the surface is evened out in time; where the surface lies, and how the body moves, is left alone."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from refmesh_addon.core.geometry import mean_edge_length
from refmesh_addon.core.steadiness import steadied
from tests.core.shapes import TILT, ball

MESH = ball(3)
LENGTH = mean_edge_length(MESH)
FRAMES = 9


def flight():
    """The ball turning and flying ever faster: (F, R, 3) places and (F, R, 3, 3) turns."""
    turn = Rotation.from_rotvec(np.outer(0.02 * np.arange(FRAMES) ** 2, [0.3, 1.0, 0.2])).as_matrix()
    shift = np.outer(0.1 * np.arange(FRAMES) ** 2, [1.0, 0.0, 0.5])
    places = np.einsum("fij,rj->fri", turn, MESH.vertices) + shift[:, None]
    return places, np.broadcast_to(turn[:, None], (FRAMES, len(MESH.vertices), 3, 3))


def noise(places, seed=0):
    """Of a tenth of an edge, split into what lies along the surface of the ball and what lies across it."""
    raw = 0.1 * LENGTH * np.random.default_rng(seed).normal(size=places.shape)
    normals = places - places.mean(axis=1, keepdims=True)
    across = normals * np.einsum("fri,fri->fr", raw, normals)[..., None]
    return raw - across, across


def acceleration(places):
    return np.linalg.norm(np.diff(places, 2, axis=0), axis=2).mean()


def test_motion_without_noise_is_left_alone():
    places, turns = flight()
    assert_allclose(steadied(MESH, places, places, turns, 3), places, atol=1e-12)


def test_a_lasting_offset_from_the_centers_is_left_alone():
    places, turns = flight()
    offset = np.einsum("frij,rj->fri", turns, 0.3 * MESH.vertices[:, [1, 2, 0]])
    assert_allclose(steadied(MESH, places, places - offset, turns, 3), places, atol=1e-12)


def test_flicker_along_the_surface_goes_and_vertices_come_nearer_to_the_truth():
    places, turns = flight()
    along, _ = noise(places)
    result = steadied(MESH, places + along, places, turns, 3)
    assert acceleration(result - places) < 0.2 * acceleration(along)
    assert np.linalg.norm(result - places, axis=2).mean() < 0.6 * np.linalg.norm(along, axis=2).mean()


def test_the_surface_stays_where_it_is():
    places, turns = flight()
    along, across = noise(places)
    fitted = places + along + across
    moves = steadied(MESH, fitted, places, turns, 3) - fitted
    outward = np.einsum("fri,fri->fr", moves, places - places.mean(axis=1, keepdims=True))
    assert np.abs(outward).mean() < 0.25 * np.linalg.norm(moves, axis=2).mean()  # its noisy normals differ from the ball's


def test_no_frames_and_one_frame_change_nothing():
    places, turns = flight()
    fitted = places + sum(noise(places))
    assert_array_equal(steadied(MESH, fitted, places, turns, 0), fitted)
    assert_allclose(steadied(MESH, fitted[:1], places[:1], turns[:1], 3), fitted[:1], atol=1e-15)


def test_turning_and_scaling_the_problem_does_so_to_the_answer():
    places, turns = flight()
    fitted, change = places + sum(noise(places)), lambda points: 1e3 * points @ TILT.T + [5.0, -2.0, 9.0]
    expected = change(steadied(MESH, fitted, places, turns, 2))
    assert_allclose(steadied(MESH, change(fitted), change(places), TILT @ turns, 2), expected, atol=1e-8)


def test_played_backwards_it_is_the_same():
    places, turns = flight()
    fitted = places + sum(noise(places))
    backwards = steadied(MESH, fitted[::-1], places[::-1], turns[::-1], 3)
    assert_allclose(backwards[::-1], steadied(MESH, fitted, places, turns, 3), atol=1e-12)
