"""The virtual depth camera: it sees the side that faces it, where it is, and with faults that are as large as stated."""

import numpy as np
import pytest
import trimesh

from refmesh_addon.core.capture.cleaning import cleaned
from refmesh_addon.core.capture.openness import OPEN, surface_kind
from refmesh_addon.core.geometry.mesh import triangle_normals
from refmesh_addon.core.types import TriangleMesh
from sample_scenes.generators.depth_camera import DepthCamera

SHAPE = trimesh.creation.icosphere(4)
BALL = TriangleMesh(SHAPE.vertices, SHAPE.faces)
PLACE = (1.0, -3.0, 2.0)


def camera(**changes):
    return DepthCamera(PLACE, (0.0, 0.0, 0.0), **changes)


def test_without_faults_the_camera_sees_the_near_side_of_a_ball_as_it_is():
    seen = camera(noise=0.0, flicker=0.0, bridged=1.0).seen(BALL, 0)
    assert len(seen.triangles) > 1000
    assert np.abs(np.linalg.norm(seen.vertices, axis=1) - 1).max() < 0.01
    assert (np.einsum("ij,ij->i", triangle_normals(seen), PLACE - seen.vertices[seen.triangles].mean(axis=1)) > 0).all()
    assert (seen.vertices @ PLACE > 0).all()


def test_noise_is_along_the_line_of_sight_and_as_large_as_stated():
    clean, noisy = (camera(noise=noise, flicker=0.0, bridged=1e3).seen(BALL, 3) for noise in (0.0, 1e-3))
    depths = [np.linalg.norm(mesh.vertices - PLACE, axis=1) for mesh in (clean, noisy)]
    assert np.std(depths[1] / depths[0]) == pytest.approx(1e-3, rel=0.1)


def test_frames_flicker_with_their_seed_and_are_equal_for_equal_seeds():
    one, again, other = (camera().seen(BALL, seed) for seed in (1, 1, 2))
    assert np.array_equal(one.vertices, again.vertices) and len(other.vertices) != len(one.vertices)


def test_the_far_one_of_two_is_hidden_and_a_skirt_joins_them_where_steps_are_bridged():
    far = BALL.moved(0.8 * BALL.vertices - np.array(PLACE) * 0.6 + [0.5, 0, 0])
    both = TriangleMesh(np.concatenate([BALL.vertices, far.vertices]), np.concatenate([BALL.triangles, far.triangles + len(BALL.vertices)]))
    strict, loose = (camera(noise=0.0, flicker=0.0, bridged=step).seen(both, 0) for step in (3.0, 1e3))
    assert len(loose.triangles) > len(strict.triangles)
    statistics = cleaned(strict).statistics
    assert surface_kind(statistics.capped, statistics.compactness, statistics.of_pieces) == OPEN


def test_nothing_in_view_is_an_empty_mesh():
    away = DepthCamera(PLACE, (2.0, -6.0, 4.0))
    assert not len(away.seen(BALL, 0).triangles)
