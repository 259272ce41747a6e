"""Patches hold what lies within the radius, spread evenly, and turn with the mesh."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from refmesh_addon.core.deformation.patches import surface_patches
from refmesh_addon.core.geometry.mesh import mean_edge_length
from refmesh_addon.core.types import TriangleMesh


def wavy(columns=40, rows=30):
    rng = np.random.default_rng(2)
    x, y = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    grid = np.stack([x, y, 2 * np.sin(x / 5) * np.cos(y / 4)], axis=2) + 0.2 * rng.normal(size=(columns, rows, 3))
    index = np.arange(columns * rows).reshape(columns, rows)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    return TriangleMesh(grid.reshape(-1, 3), np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3))


KEYPOINTS = np.array([0, 17, 333, 620, 621, 1199])


def test_points_are_vertices_within_the_radius_each_once_the_key_point_first():
    mesh = wavy()
    patches = surface_patches(mesh, KEYPOINTS, 5.0, count=40)
    assert_array_equal(patches.positions, mesh.vertices[KEYPOINTS])
    assert_array_equal(patches.offsets[:, 0], 0)
    for position, offsets, filled in zip(patches.positions, patches.offsets, patches.filled):
        gap, vertex = cKDTree(mesh.vertices).query(position + offsets)
        within = np.count_nonzero(np.linalg.norm(mesh.vertices - position, axis=1) <= 5.0)
        assert gap.max() < 1e-12
        assert np.linalg.norm(offsets, axis=1).max() <= 5.0
        assert filled.sum() == min(40, within)
        assert len(np.unique(vertex[filled])) == filled.sum()
        assert set(vertex[~filled]) <= set(vertex[filled])


def test_few_points_still_reach_every_part_of_the_patch():
    mesh = wavy()
    patches = surface_patches(mesh, KEYPOINTS[2:4], 8.0, count=24)
    for position, offsets in zip(patches.positions, patches.offsets):
        within = mesh.vertices[np.linalg.norm(mesh.vertices - position, axis=1) <= 8.0] - position
        first = within[np.argsort(np.linalg.norm(within, axis=1))[:24]]
        assert cKDTree(offsets).query(within)[0].max() < 0.5 * cKDTree(first).query(within)[0].max()


def test_patches_turn_and_grow_with_the_mesh():
    mesh = wavy()
    turn, _ = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    plain = surface_patches(mesh, KEYPOINTS, 5.0)
    moved = surface_patches(mesh.moved(10 * mesh.vertices @ turn.T + 7), KEYPOINTS, 50.0)
    assert_allclose(moved.offsets, 10 * plain.offsets @ turn.T, atol=1e-9)
    assert_array_equal(moved.filled, plain.filled)
    assert_allclose(moved.normals, plain.normals @ turn.T, atol=1e-12)
    assert_allclose(np.linalg.det(moved.axes), 1)
    # axes have no direction of their own, only the last one points outward
    assert_allclose(np.abs(np.einsum("kij,kij->kj", turn @ plain.axes, moved.axes)), 1, atol=1e-9)
    assert_allclose(moved.axes[:, :, 2], plain.axes[:, :, 2] @ turn.T, atol=1e-9)


def test_no_key_points_and_no_radius():
    mesh = wavy()
    assert surface_patches(mesh, np.empty(0, dtype=int), mean_edge_length(mesh)).offsets.shape[0] == 0
    with pytest.raises(ValueError, match="radius"):
        surface_patches(mesh, KEYPOINTS, 0.0)
