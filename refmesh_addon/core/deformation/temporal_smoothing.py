"""Vertices that tremble along the surface from frame to frame are brought to rest.

Every frame is fitted by itself, to triangles of its own, and pulls each vertex a little its own way along the surface. Over a
few frames a spot of the skin moves on a parabola: what of that a frame misses is noise, unless all around misses it as well, as
where a limb stops short. Velocity and acceleration are kept (Savitzky and Golay 1964), and where the surface lies is left to the
fit: vertices move along it only, and on a crease along the crease.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.cotangent import cotangent_weights
from ..geometry.factor import factored
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import triangle_areas, vertex_areas
from ..geometry.tangents import tangential_part
from ..geometry.vectors import TINY
from ..types import TriangleMesh

DEGREE = 2
LEASH = 0.5  # mean edge lengths that a vertex may be moved: on a path more bent than a parabola, it keeps near to its place
# Extent, as a share of the square root of the area, of what moves as one. Trembling reaches over some edges, a limb is longer: where the
# frames are three times as far apart as usual, the surface strayed from the source by twice as much without this.
LIMB = 0.25


def steadied(mesh: TriangleMesh, vertices: np.ndarray, times: np.ndarray, frames: int) -> np.ndarray:
    """(F, R, 3) vertices moved along the surface only, so that they keep their places on it from frame to frame.

    mesh : the reference.  vertices : (F, R, 3) in successive frames, scene units.  times : (F,) ascending, any unit.
    frames : how many to either side have a say; 0 gives the vertices back, and fewer than four frames in all change nothing.
    """
    if not frames or len(vertices) <= DEGREE + 1:
        return vertices
    missed = np.tensordot(_parabolas(times, frames) - np.eye(len(vertices)), vertices, axes=1)
    missed -= _shared(mesh, missed)
    ends = HalfEdges.of(mesh).edges.T
    return np.stack([positions + _leashed(mesh.moved(positions), move, ends) for positions, move in zip(vertices, missed)])


def _shared(mesh: TriangleMesh, moves: np.ndarray) -> np.ndarray:
    """(F, R, 3) the part of moves that all of a limb shares: smoothed over the surface to the extent of one."""
    areas = vertex_areas(mesh)
    areas = np.where(areas > 0, areas, areas.mean())
    extent = LIMB**2 * triangle_areas(mesh).sum()
    factor = factored(sparse.diags(areas) + extent * sparse.csgraph.laplacian(cotangent_weights(mesh)))
    return np.stack([factor.solve(areas[:, None] * move) for move in moves])


def _leashed(surface: TriangleMesh, moves: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """(R, 3) moves along the surface, none longer than the leash.  ends : (2, E) vertices of its edges."""
    moves = tangential_part(surface, moves)
    span = np.linalg.norm(surface.vertices[ends[0]] - surface.vertices[ends[1]], axis=1).mean() if ends.size else 0.0
    leash = max(LEASH * float(span), float(TINY))
    return moves * leash / np.maximum(np.linalg.norm(moves, axis=1, keepdims=True), leash)


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
