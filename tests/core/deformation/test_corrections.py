"""Offsets that follow a surface in its own local frames."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from refmesh_addon.core.deformation.corrections import LocalFrames, influence
from refmesh_addon.core.types import TriangleMesh

from ..shapes import ball


def test_offsets_turn_with_a_rigid_motion():
    mesh = ball(2)
    chosen = np.array([0, 5, 9])
    offsets = np.random.default_rng(0).normal(size=(3, 3))
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    frames = LocalFrames(mesh, chosen, 0.5)
    pose = mesh.vertices @ turn.T + [3.0, 2.0, 1.0]
    np.testing.assert_allclose(frames.to_pose(offsets, pose), offsets @ turn.T, atol=1e-9)


def test_drawn_in_any_pose_an_offset_comes_back_in_that_pose():
    mesh = ball(2)
    pose = mesh.vertices * [1.0, 1.4, 0.7] + 0.2 * np.sin(3 * mesh.vertices[:, [1, 2, 0]])
    chosen = np.arange(0, len(mesh.vertices), 7)
    drawn = np.random.default_rng(1).normal(size=(len(chosen), 3))
    frames = LocalFrames(mesh, chosen, 0.5)
    np.testing.assert_allclose(frames.to_pose(frames.to_rest(drawn, pose), pose), drawn, atol=1e-12)


def test_rotations_are_those_of_single_vertices():
    """Asked for some vertices, the frames are the same as asked for all of them."""
    mesh = ball(2)
    pose = mesh.vertices * [1.0, 1.4, 0.7]
    everything = LocalFrames(mesh, np.arange(len(mesh.vertices)), 0.5).rotations(pose)
    np.testing.assert_allclose(LocalFrames(mesh, np.array([3, 1]), 0.5).rotations(pose), everything[[3, 1]], atol=1e-12)


def test_long_offsets_stay_together_on_a_noisy_pose():
    """One ring alone would turn neighbors apart by several degrees."""
    mesh = ball(3)
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    pose = (mesh.vertices + np.random.default_rng(2).normal(scale=0.01, size=mesh.vertices.shape)) @ turn.T
    chosen = np.flatnonzero(mesh.vertices[:, 2] > 0.8)
    offsets = np.tile([0.0, 0.0, 1.0], (len(chosen), 1))
    spread = [np.ptp(LocalFrames(mesh, chosen, reach).to_pose(offsets, pose), axis=0).max() for reach in (0.0, 1.0)]
    assert spread[1] < 0.02 < 0.1 < spread[0]


@pytest.mark.parametrize("frame, expected", [(10, 1.0), (12, 1.0), (9, 0.75), (7, 0.25), (6, 0.0), (13, 0.75), (99, 0.0)])
def test_influence_fades_outside_its_range(frame, expected):
    assert influence(frame, 10, 12, 3) == pytest.approx(expected)
    assert influence(frame, 10, 12, 0) == (expected == 1.0)


def test_a_mesh_without_vertices_to_correct_is_no_error():
    frames = LocalFrames(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), np.empty(0, dtype=int), 1.0)
    assert frames.to_pose(np.empty((0, 3)), np.zeros((3, 3))).shape == (0, 3)
