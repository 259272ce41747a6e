"""Surface patches around key points, each a fixed number of points, ready to be compared many at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.mesh import vertex_normals
from ..types import FrozenArrays, TriangleMesh

PATCH_POINTS = 128  # finer sampling tells little more, and the cost is quadratic
PATCH_RADIUS = 12.0  # of the length that the key points were detected with; smaller ones mistake one limb for another
BLOCK_ENTRIES = 1 << 15  # padded neighbors held at once: small enough for the processor's cache


@dataclass(frozen=True)
class Patches(FrozenArrays):
    """N(r) of the paper: the surface vertices within a radius around each key point.

    vertices : (K,) int64, key points as vertex indices of their mesh.
    positions : (K, 3), the key points, scene units.
    offsets : (K, n, 3), points of the patch minus its key point, spread evenly, coarse to fine, the key point itself first.
    filled : (K, n) bool, False where a patch has fewer points; `offsets` repeats a point there.
    normals : (K, 3) unit normals at the key points.
    axes : (K, 3, 3), the principal axes of the patch as columns, largest extent first, right-handed, the last one outward.
    radius : scene units.
    """

    vertices: np.ndarray
    positions: np.ndarray
    offsets: np.ndarray
    filled: np.ndarray
    normals: np.ndarray
    axes: np.ndarray
    radius: float


def surface_patches(mesh: TriangleMesh, keypoints: np.ndarray, radius: float, count: int = PATCH_POINTS) -> Patches:
    """Patches around the (K,) vertices of a mesh whose coincident vertices are merged.

    radius : scene units; the same for meshes whose patches are to be compared.
    """
    if not radius > 0:
        raise ValueError(f"radius must be above 0; got {radius}")
    keypoints = np.asarray(keypoints, dtype=np.int64)
    tree = cKDTree(mesh.vertices)
    positions = mesh.vertices[keypoints]
    sizes = tree.query_ball_point(positions, radius, return_length=True)
    offsets, filled = np.zeros((len(keypoints), count, 3)), np.zeros((len(keypoints), count), dtype=bool)
    by_size = np.argsort(sizes, kind="stable")  # patches of about one size share a block, so little of it is padding
    for rows in filter(len, np.split(by_size, np.flatnonzero(np.diff(np.cumsum(sizes[by_size]) // BLOCK_ENTRIES)) + 1)):
        near = _padded(tree.query_ball_point(positions[rows], radius), keypoints[rows])
        picks = _farthest_points(mesh.vertices[near] - positions[rows, None], count)
        offsets[rows] = np.take_along_axis(mesh.vertices[near] - positions[rows, None], picks[:, :, None], axis=1)
        filled[rows] = np.arange(count) < sizes[rows, None]
    normals = vertex_normals(mesh)[keypoints]
    return Patches(keypoints, positions, offsets, filled, normals, _principal_axes(offsets, filled, normals), float(radius))


def _padded(lists: np.ndarray, keypoints: np.ndarray) -> np.ndarray:
    """Neighbor lists as one (K, P) array, the key point first and again where a list is shorter."""
    longest = max(map(len, lists))
    return np.array([[own, *near, *[own] * (longest - len(near))] for own, near in zip(keypoints, lists, strict=True)])


def _farthest_points(offsets: np.ndarray, count: int) -> np.ndarray:
    """(K, count) picks out of (K, P, 3) points: the first point, then always the one farthest from those picked so far."""
    axes = np.ascontiguousarray(offsets.transpose(2, 0, 1), dtype=np.float32)  # half the memory: it only has to be spread out
    rows = np.arange(len(offsets))
    picks = np.zeros((len(offsets), count), dtype=np.int64)
    squares, gap = np.empty((2, *offsets.shape[:2]), dtype=np.float32)
    nearest = np.full_like(squares, np.inf)
    for step in range(1, count):
        squares[:] = 0.0
        for axis in axes:
            np.subtract(axis, axis[rows, picks[:, step - 1], None], out=gap)
            squares += np.multiply(gap, gap, out=gap)
        np.minimum(nearest, squares, out=nearest)
        picks[:, step] = nearest.argmax(axis=1)
    return picks


def _principal_axes(offsets: np.ndarray, filled: np.ndarray, normals: np.ndarray) -> np.ndarray:
    spread = np.einsum("kni,knj,kn->kij", offsets, offsets, filled.astype(float))
    axes = np.linalg.eigh(spread)[1][:, :, ::-1].copy()
    outward = np.where(np.einsum("ki,ki->k", axes[:, :, 2], normals) < 0, -1.0, 1.0)
    axes[:, :, 2] *= outward[:, None]
    axes[:, :, 1] = np.cross(axes[:, :, 2], axes[:, :, 0])
    return axes
