"""Corrections of a surface in its own local frames: an offset drawn in one frame follows the surface through all others.

The local frame of a vertex turns by the rotation that the as-rigid-as-possible energy gives it (Sorkine & Alexa 2007, equation 6): the one
that carries its edges from the rest shape to the pose best. One ring of edges is too noisy for that: at the end of a long offset, small
differences of direction tear the surface. So covariances are first diffused over the surface, about as far as the longest offset is long.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..geometry.cotangent import cotangent_weights, spokes, triangle_adjacency
from ..geometry.mesh import mean_edge_length
from ..geometry.rotations import closest_rotations
from ..geometry.vectors import TINY
from ..types import TriangleMesh


class LocalFrames:
    """Rotations of chosen vertices from the rest shape to any pose: built once, queried for each frame.

    rest : R vertices.  chosen : (N,) int, vertices whose rotations are of interest.  reach : over what distance rotations are alike,
    scene units.
    """

    def __init__(self, rest: TriangleMesh, chosen: np.ndarray, reach: float):
        self._chosen = np.asarray(chosen)
        self._covariances = spokes(cotangent_weights(rest), rest.vertices)
        adjacency = triangle_adjacency(rest)
        degree = np.asarray(adjacency.sum(axis=1)).ravel()
        laplacian = sparse.diags((degree > 0).astype(float)) - sparse.diags(1.0 / np.maximum(degree, TINY)) @ adjacency
        edge = mean_edge_length(rest)
        steps = (reach / edge) ** 2 if edge > 0 else 0.0
        self._diffusion = splu((sparse.identity(len(degree)) + steps * laplacian).tocsc())

    def rotations(self, pose: np.ndarray) -> np.ndarray:
        """(N, 3, 3) rotations to the pose, (R, 3) positions in scene units."""
        transposed = (self._covariances @ pose).reshape(-1, 9)
        return closest_rotations(self._diffusion.solve(transposed)[self._chosen].reshape(-1, 3, 3).transpose(0, 2, 1))

    def to_pose(self, offsets: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """(N, 3) offsets of the rest shape as they are in the pose."""
        return np.einsum("nij,nj->ni", self.rotations(pose), offsets)

    def to_rest(self, offsets: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """(N, 3) offsets drawn in the pose as they are on the rest shape: the inverse of `to_pose`."""
        return np.einsum("nji,nj->ni", self.rotations(pose), offsets)


def influence(frame: int, first: int, last: int, fade: int) -> float:
    """1 from `first` to `last`, both included, falling to 0 over the `fade` frames before and after."""
    outside = max(first - frame, frame - last, 0)
    return max(0.0, 1.0 - outside / (fade + 1))
