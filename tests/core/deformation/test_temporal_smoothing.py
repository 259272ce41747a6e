"""Jitter along the surface goes; the shape of the surface and the motion of the body are left alone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from refmesh_addon.core.deformation.temporal_smoothing import FARTHEST, smoothed_in_time
from refmesh_addon.core.geometry.mesh import mean_edge_length
from tests.core.shapes import TILT, ball, box

MESH = ball(3)
LENGTH = mean_edge_length(MESH)
FRAMES = 9


def smoothed(places, frames):
    return smoothed_in_time(MESH, places, np.arange(len(places)), frames)


def flight(pace=0.004):
    """(F, R, 3) places of the ball, turning and flying ever faster."""
    turn = Rotation.from_rotvec(np.outer(pace * np.arange(FRAMES) ** 2, [0.3, 1.0, 0.2])).as_matrix()
    shift = np.outer(0.1 * np.arange(FRAMES) ** 2, [1.0, 0.0, 0.5])
    return np.einsum("fij,rj->fri", turn, MESH.vertices) + shift[:, None]


def noise(places):
    """Of a tenth of an edge, split into what lies along the surface of the ball and what lies across it."""
    raw = 0.1 * LENGTH * np.random.default_rng(0).normal(size=places.shape)
    normals = places - places.mean(axis=1, keepdims=True)
    across = normals * np.einsum("fri,fri->fr", raw, normals)[..., None]
    return raw - across, across


def acceleration(places):
    return np.linalg.norm(np.diff(places, 2, axis=0), axis=2).mean()


def test_speeding_up_evenly_is_left_alone():
    places = flight(pace=0.0)
    assert_allclose(smoothed(places, 2), places, atol=1e-12)


def test_frames_that_are_missing_do_not_matter_to_it():
    there = np.array([0, 1, 3, 4, 8])
    each_its_own = np.random.default_rng(0).normal(size=MESH.vertices.shape)
    places = (flight(pace=0.0) + 0.01 * LENGTH * each_its_own * np.arange(FRAMES)[:, None, None] ** 2)[there]
    assert_allclose(smoothed_in_time(MESH, places, there, 2), places, atol=1e-12)
    assert np.abs(smoothed(places, 2) - places).max() > 0.01 * LENGTH


def test_turning_ever_faster_is_hardly_touched():
    places = flight()
    assert np.linalg.norm(smoothed(places, 2) - places, axis=2).max() < 0.01 * LENGTH


def test_a_jolt_of_the_whole_body_is_left_alone():
    """No parabola follows it, but what all around shares is no jitter."""
    places = flight(pace=0.0) + np.sin(2.0 * np.arange(FRAMES))[:, None, None] * [0.3, 0.0, 0.1]
    assert_allclose(smoothed(places, 2), places, atol=1e-9)


def test_vertices_of_creases_stay_on_them_and_corners_where_they_are():
    cube = box((2.0, 2.0, 2.0), subdivisions=4)
    rng, sides = np.random.default_rng(0), np.isclose(np.abs(cube.vertices), 1.0)
    jittering = np.stack([cube.vertices] * FRAMES) + 0.03 * np.where(sides, 0.0, rng.normal(size=(FRAMES, *cube.vertices.shape)))
    result = smoothed_in_time(cube, jittering, np.arange(FRAMES), 2)
    assert_allclose(np.abs(result)[:, sides], 1.0, atol=1e-9)
    assert acceleration(result) < 0.7 * acceleration(jittering)


def test_jitter_along_the_surface_goes_and_vertices_come_nearer_to_the_truth():
    places = flight()
    along, _ = noise(places)
    result = smoothed(places + along, 2)
    assert acceleration(result - places) < 0.5 * acceleration(along)
    assert np.linalg.norm(result - places, axis=2).mean() < 0.85 * np.linalg.norm(along, axis=2).mean()


def test_a_wider_filter_smooths_more():
    places = flight()
    along, _ = noise(places)
    left = [np.linalg.norm(smoothed(places + along, frames) - places, axis=2).mean() for frames in (0, 2, 4)]
    assert left[0] > left[1] > left[2]


def test_the_surface_stays_where_it_is():
    places = flight()
    fitted = places + sum(noise(places))
    moves = smoothed(fitted, 2) - fitted
    outward = np.einsum("fri,fri->fr", moves, places - places.mean(axis=1, keepdims=True))
    assert np.abs(outward).mean() < 0.25 * np.linalg.norm(moves, axis=2).mean()  # its noisy normals differ from the ball's


@pytest.mark.parametrize("frames, count", [(0, FRAMES), (2, 1), (2, 2), (2, 3)])
def test_too_few_frames_change_nothing(frames, count):
    fitted = flight()[:count]
    fitted = fitted + sum(noise(fitted))
    assert_allclose(smoothed(fitted, frames), fitted, atol=1e-13)


def test_no_vertex_moves_farther_than_allowed():
    places = flight()
    places[4] += 3.0 * LENGTH * np.random.default_rng(0).normal(size=MESH.vertices.shape)
    longest = [FARTHEST * mean_edge_length(MESH.moved(positions)) for positions in places]
    moves = np.linalg.norm(smoothed(places, 2) - places, axis=2).max(axis=1)
    assert (moves <= (1 + 1e-9) * np.array(longest)).all() and moves.max() > 0.9 * FARTHEST * LENGTH


def test_turning_and_scaling_the_problem_does_so_to_the_answer():
    places = flight()
    fitted, change = places + sum(noise(places)), lambda points: 1e3 * points @ TILT.T + [5.0, -2.0, 9.0]
    assert_allclose(smoothed(change(fitted), 2), change(smoothed(fitted, 2)), atol=1e-8)


def test_played_backwards_it_is_the_same():
    places = flight()
    fitted = places + sum(noise(places))
    assert_allclose(smoothed(fitted[::-1], 2)[::-1], smoothed(fitted, 2), atol=1e-12)


def test_frames_beyond_the_filter_change_nothing():
    places = flight()
    other = places.copy()
    other[-1] += 0.3 * LENGTH * np.random.default_rng(0).normal(size=MESH.vertices.shape)
    assert np.abs(smoothed(other, 2) - smoothed(places, 2)).max() > 0.01 * LENGTH
    assert_array_equal(smoothed(other, 2)[:4], smoothed(places, 2)[:4])


def test_some_rows_are_those_of_all_frames():
    mesh, rng = ball(2), np.random.default_rng(0)
    vertices = mesh.vertices + 0.01 * rng.standard_normal((12, *mesh.vertices.shape))
    times = np.arange(12.0)
    every = smoothed_in_time(mesh, vertices, times, 2)
    assert_allclose(smoothed_in_time(mesh, vertices, times, 2, slice(3, 7)), every[3:7], rtol=0, atol=1e-12)
