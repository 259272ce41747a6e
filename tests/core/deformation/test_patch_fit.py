"""Turning a patch about its key point finds the rotation back, and nothing but a rotation."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from refmesh_addon.core.deformation import patch_fit
from refmesh_addon.core.deformation.patch_fit import fit_patches
from refmesh_addon.core.deformation.patches import surface_patches
from refmesh_addon.core.types import TriangleMesh


def rough(seed=3, columns=36, rows=28, lift=0.0):
    """A sheet with hills, rough enough to have one fit only; `lift` moves it square to itself."""
    x, y = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    hills = np.random.default_rng(seed).random((40, 3)) * [columns, rows, 1]
    z = sum((6 * a - 3) * np.exp(-((x - u) ** 2 + (y - v) ** 2) / 6) for u, v, a in hills) + lift
    index = np.arange(columns * rows).reshape(columns, rows)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3)
    return TriangleMesh(np.stack([x, y, z], axis=2).reshape(-1, 3), triangles)


KEYPOINTS = np.array([300, 410, 500, 610, 700])
SAME = (np.arange(5), np.arange(5))


def slow_error(offsets, turned, target):
    there = cKDTree(target).query(turned)[0]
    back = cKDTree(turned).query(target)[0]
    assert len(offsets) == len(turned)
    return there.mean() + max(there.max(), back.max())


def test_the_error_is_that_of_the_paper_and_belongs_to_the_rotation():
    reference, frame = surface_patches(rough(), KEYPOINTS, 6.0), surface_patches(rough(4), KEYPOINTS, 6.0)
    rows, columns = (grid.ravel() for grid in np.meshgrid(np.arange(5), np.arange(5), indexing="ij"))
    errors, rotations = fit_patches(reference, frame, (rows, columns), np.broadcast_to(np.eye(3), (25, 3, 3)))
    assert_allclose(np.linalg.det(rotations), 1)
    for r, f, error, rotation in zip(rows, columns, errors, rotations):
        points, target = reference.offsets[r][reference.filled[r]], frame.offsets[f][frame.filled[f]]
        assert_allclose(error * 6.0, slow_error(points, points @ rotation.T, target), atol=1e-6)
        assert error * 6.0 <= slow_error(points, points, target) + 1e-6  # never worse than its start


@pytest.mark.parametrize("fixed_point", [True, False])
def test_a_known_rotation_is_found_from_a_start_some_way_off(fixed_point):
    turns = Rotation.from_euler("xyz", np.random.default_rng(5).uniform(-180, 180, (5, 3)), degrees=True)
    mesh = rough()
    reference = surface_patches(mesh, KEYPOINTS, 6.0)
    for i, turn in enumerate(turns):
        frame = surface_patches(mesh.moved(mesh.vertices @ turn.as_matrix().T + [50, 0, -9]), KEYPOINTS, 6.0)
        start = Rotation.from_rotvec([0.05, -0.04, 0.06]) * turn
        errors, rotations = fit_patches(reference, frame, (np.array([i]), np.array([i])), start.as_matrix()[None], fixed_point)
        assert_allclose(rotations[0], turn.as_matrix(), atol=1e-6)
        assert_allclose(errors, 0, atol=1e-6)


def test_the_fixed_point_tells_one_side_of_a_thin_sheet_from_the_other():
    """The thin hand of the paper: both sides have the same points around them, but not around the same point."""
    palm, back = rough(), rough(lift=-2.5)
    count = len(palm.vertices)
    hand = TriangleMesh(np.concatenate([palm.vertices, back.vertices]), np.concatenate([palm.triangles, back.triangles[:, ::-1] + count]))
    own, other = surface_patches(hand, KEYPOINTS, 8.0), surface_patches(hand, KEYPOINTS + count, 8.0)
    start = np.broadcast_to(np.eye(3), (5, 3, 3))
    fixed, _ = fit_patches(own, other, SAME, start, fixed_point=True)
    free, _ = fit_patches(own, other, SAME, start, fixed_point=False)
    assert fixed.min() > 0.4
    assert free.max() < 0.4
    assert (free < 0.75 * fixed).all()


def test_memory_blocks_change_nothing(monkeypatch):
    reference, frame = surface_patches(rough(), KEYPOINTS, 6.0), surface_patches(rough(4), KEYPOINTS, 6.0)
    start = np.broadcast_to(np.eye(3), (5, 3, 3))
    whole = fit_patches(reference, frame, SAME, start)
    monkeypatch.setattr(patch_fit, "BLOCK_ENTRIES", 1)
    for one, other in zip(whole, fit_patches(reference, frame, SAME, start)):
        assert_allclose(one, other, rtol=1e-12, atol=1e-12)
