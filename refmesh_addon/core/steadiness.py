"""Vertices that slide to and fro along the surface from frame to frame are brought to rest.

Every frame is fitted by itself, to triangles of its own, and pulls each vertex a little its own way along the surface. What
counts is how a vertex lies beside the place where the centers carry it, seen from its own turned surroundings: there a spot
of the skin hardly moves, however fast the body does, so evening it out in time takes the noise and leaves the motion.
"""

from __future__ import annotations

import numpy as np

from .geometry import vertex_normals
from .types import TriangleMesh

SHARE = 0.25  # of each neighbour in a frame's new value: of all such means the one that damps a flicker most


def steadied(mesh: TriangleMesh, vertices: np.ndarray, carried: np.ndarray, turns: np.ndarray, frames: int) -> np.ndarray:
    """(F, R, 3) vertices moved along the surface only, so that they keep their places on it from frame to frame.

    mesh : its triangles count.  vertices : (F, R, 3) fitted, in successive frames, scene units.  carried : (F, R, 3) where the
    centers carry them.  turns : (F, R, 3, 3) how the surroundings of each turn on the way (column vectors).
    frames : how far evening out reaches to either side; 0 gives the vertices back.
    """
    beside = np.einsum("frji,frj->fri", turns, vertices - carried)
    even = beside
    for _ in range(frames):
        padded = np.concatenate([even[:1], even, even[-1:]])
        even = (1 - 2 * SHARE) * even + SHARE * (padded[:-2] + padded[2:])
    moves = np.einsum("frij,frj->fri", turns, even - beside)
    normals = np.stack([vertex_normals(mesh.moved(frame)) for frame in vertices])
    return vertices + moves - normals * np.einsum("fri,fri->fr", moves, normals)[..., None]
