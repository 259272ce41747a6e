"""A normal and two tangents at vertices, in integers that are the same on every platform."""

from __future__ import annotations

import numpy as np

SCALE = 1 << 12  # length of the integer vectors


def surface_frames(triangles: np.ndarray, points: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """(3, N, 3) integers in float64: normal, first and second tangent at each of (N,) chosen vertices.

    triangles : (T, 3) int64.  points : (V, 3) integers, grid units; sums of their products stay below 2^53.
    """
    normals = _unit(_normals(triangles, points)[chosen], fallback=2)
    flattest = np.argmin(np.abs(normals), axis=1)
    first = _unit(_cross(normals, np.eye(3)[flattest]), fallback=0)
    return np.stack([normals, first, np.rint(_cross(normals, first) / SCALE)])


def from_frames(frames: np.ndarray, along: np.ndarray) -> np.ndarray:
    """(..., N, 3) whole vectors of (..., N, 3) whole components along normal, first and second tangent."""
    total = frames[0] * along[..., :1]
    total += frames[1] * along[..., 1:2]
    total += frames[2] * along[..., 2:]
    return np.rint(total / SCALE)


def along_frames(frames: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """(..., N, 3) components of (..., N, 3) vectors along normal, first and second tangent."""
    return np.stack([(vectors * axis).sum(axis=-1) for axis in frames / SCALE], axis=-1)


def _normals(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(V, 3) integers: twice the area vectors of the triangles around each vertex."""
    a, b, c = (points[corner] for corner in triangles.T)
    normal = _cross(b - a, c - a)
    corners = triangles.T.ravel()
    sums = [np.bincount(corners, np.tile(axis, 3), len(points)) for axis in normal.T]
    return np.stack(sums, axis=1)


def _cross(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.stack([u[:, y] * v[:, z] - u[:, z] * v[:, y] for y, z in ((1, 2), (2, 0), (0, 1))], axis=1)


def _unit(vectors: np.ndarray, fallback: int) -> np.ndarray:
    """Vectors of about the length SCALE, rounded; along axis `fallback` where there is no direction."""
    square = vectors[:, 0] * vectors[:, 0]
    square += vectors[:, 1] * vectors[:, 1]
    square += vectors[:, 2] * vectors[:, 2]
    empty = ~(square > 0)
    length = np.sqrt(np.where(empty, 1.0, square))
    return np.where(empty[:, None], SCALE * np.eye(3)[fallback], np.rint(vectors / length[:, None] * SCALE))
