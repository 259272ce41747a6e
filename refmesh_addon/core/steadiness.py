"""Vertices that tremble along the surface from frame to frame are brought to rest.

Every frame is fitted by itself, to triangles of its own, and pulls each vertex a little its own way along the surface. Over a
few frames a spot of the skin moves on a parabola: what of that a frame misses, along the surface, is noise. Velocity and
acceleration are kept (Savitzky and Golay 1964), and where the surface lies is left to the fit.
"""

from __future__ import annotations

import numpy as np

from .geometry import TINY, edges, vertex_normals
from .types import TriangleMesh

DEGREE = 2
LEASH = 0.5  # mean edge lengths that a vertex may be moved: on a path more bent than a parabola, it keeps near to its place


def steadied(mesh: TriangleMesh, vertices: np.ndarray, times: np.ndarray, frames: int) -> np.ndarray:
    """(F, R, 3) vertices moved along the surface only, so that they keep their places on it from frame to frame.

    mesh : its triangles count.  vertices : (F, R, 3) in successive frames, scene units.  times : (F,) ascending, any unit.
    frames : how many to either side have a say; 0 gives the vertices back, and fewer than four frames in all change nothing.
    """
    ends = edges(mesh).T
    moves = np.tensordot(_parabolas(times, frames) - np.eye(len(vertices)), vertices, axes=1)
    for move, positions in zip(moves, vertices):
        surface = mesh.moved(positions)
        normals = vertex_normals(surface)
        move -= normals * np.einsum("ri,ri->r", move, normals)[:, None]
        length = np.linalg.norm(move, axis=1, keepdims=True)
        span = np.linalg.norm(positions[ends[0]] - positions[ends[1]], axis=1).mean() if ends.size else 0.0
        move *= np.minimum(1.0, LEASH * span / np.maximum(length, TINY))
    return vertices + moves


def _parabolas(times: np.ndarray, frames: int) -> np.ndarray:
    """(F, F) matrix that takes positions to those on the parabolas fitted to the nearest 2 `frames` + 1 of them."""
    count = len(times)
    width = min(2 * frames + 1, count)
    result = np.zeros((count, count))
    for frame in range(count):
        first = min(max(frame - frames, 0), count - width)
        powers = np.vander(times[first : first + width].astype(float) - times[frame], min(DEGREE + 1, width), increasing=True)
        result[frame, first : first + width] = np.linalg.pinv(powers)[0]
    return result
