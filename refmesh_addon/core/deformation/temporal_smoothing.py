"""Removes the jitter of vertices along the surface from frame to frame, with a Savitzky-Golay filter (Savitzky and Golay 1964).

Every frame is fitted by itself, to triangles of its own, which shifts each vertex a little along the surface. Over a few frames a
point of the skin moves on a parabola: the deviation of a frame from it is noise, unless the surroundings deviate in the same way,
as where a limb stops short. Velocity and acceleration are kept, and the shape of the surface is left to the fit: vertices move
along it only, and on a crease along the crease.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.cotangent import cotangent_weights
from ..geometry.factor import factored
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import edge_lengths, triangle_areas, vertex_areas
from ..geometry.tangents import tangential_part
from ..geometry.vectors import TINY
from ..types import TriangleMesh

DEGREE = 2
FARTHEST = 0.5  # mean edge lengths that a vertex may be moved: it stays close even where its path is more curved than a parabola
# Extent, as a share of the square root of the area, of what moves as one. Jitter is correlated over some edges, a limb is longer: with
# frames three times as far apart as usual, the surface departed from the source by twice as much without this.
LIMB = 0.25


def smoothed_in_time(
    mesh: TriangleMesh, vertices: np.ndarray, times: np.ndarray, frames: int, rows: slice = slice(None)
) -> np.ndarray:
    """(F, R, 3) vertices without jitter, moved along the surface only.

    mesh : the reference.  vertices : (F, R, 3) in successive frames, scene units.  times : (F,) ascending, any unit.
    frames : half the width of the filter. 0 returns the vertices, as do fewer than four frames in all.
    rows : the frames to return, where the others are only there because the filter needs them.
    """
    if not frames or len(vertices) <= DEGREE + 1:
        return vertices[rows]
    deviation = np.tensordot((_parabolas(times, frames) - np.eye(len(vertices)))[rows], vertices, axes=1)
    deviation -= _common(mesh, deviation)
    ends = HalfEdges.of(mesh).edges.T
    return np.stack([positions + _limited(mesh.moved(positions), move, ends) for positions, move in zip(vertices[rows], deviation)])


def _common(mesh: TriangleMesh, moves: np.ndarray) -> np.ndarray:
    """(F, R, 3) the part of moves that is common to a limb: smoothed over the surface to the extent of one."""
    areas = vertex_areas(mesh)
    areas = np.where(areas > 0, areas, areas.mean())
    extent = LIMB**2 * triangle_areas(mesh).sum()
    factor = factored(sparse.diags(areas) + extent * sparse.csgraph.laplacian(cotangent_weights(mesh)))
    return np.stack([factor.solve(areas[:, None] * move) for move in moves])


def _limited(surface: TriangleMesh, moves: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """(R, 3) the part of moves along the surface, none longer than FARTHEST.  ends : (2, E) vertices of its edges."""
    moves = tangential_part(surface, moves)
    length = edge_lengths(surface.vertices, ends.T).mean() if ends.size else 0.0
    farthest = max(FARTHEST * float(length), float(TINY))
    return moves * farthest / np.maximum(np.linalg.norm(moves, axis=1, keepdims=True), farthest)


def _parabolas(times: np.ndarray, frames: int) -> np.ndarray:
    """(F, F) matrix that takes positions to those on the parabolas fitted to the nearest 2 `frames` + 1 of them, at any `times`."""
    count = len(times)
    width = min(2 * frames + 1, count)
    result = np.zeros((count, count))
    for frame in range(count):
        first = min(max(frame - frames, 0), count - width)
        powers = np.vander(times[first : first + width].astype(float) - times[frame], min(DEGREE + 1, width), increasing=True)
        result[frame, first : first + width] = np.linalg.pinv(powers)[0]
    return result
