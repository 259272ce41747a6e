"""Charts of a texture layout: which triangles they hold, small ones joined to their neighbors, and those laid out badly."""

from __future__ import annotations

import numpy as np

from ..geometry.graph import connected_components
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import triangle_areas
from ..types import TriangleMesh
from .layout import signed_areas, stretches
from .raster import rasterized

SMALLEST = 1e-4  # share of the surface: 8 x 8 texels of a texture of 1024 of which two thirds are used
ROUNDS = 32  # of joining; each at least halves the small charts that touch each other
SAME_PLACE = 1e-6  # share of the texture's side
MOST_STRETCH = 1.1  # of a chart; beyond, its texels differ too much in size
MOST_FOLDED = 1e-3  # share of a chart's surface that faces away or has no area in the texture
MOST_SHARED = 2e-3  # share of a chart's texels that two of its triangles cover
CHECKED_SIZE = 1024  # texels along a side at which that is counted


def charts_of(mesh: TriangleMesh, corners: np.ndarray) -> np.ndarray:
    """(T,) chart of each triangle: those that have equal places at a common edge share one.

    corners : (T, 3, 2) places of the triangles' corners, 0 to 1.
    """
    one, other = _facing_pairs(mesh)
    flat = corners.reshape(-1, 2)
    same = np.abs(flat[one] - flat[_next(other)]).max(axis=1) < SAME_PLACE
    same &= np.abs(flat[_next(one)] - flat[other]).max(axis=1) < SAME_PLACE
    return _numbered(one[same], other[same], len(mesh.triangles))


def joined_charts(mesh: TriangleMesh, charts: np.ndarray, least: float = SMALLEST) -> np.ndarray:
    """(T,) charts, of which those smaller than a share `least` of the surface go to the larger neighbor with the longest common border."""
    one, other = _facing_pairs(mesh)
    ends = mesh.vertices[mesh.triangles.ravel()]
    lengths = np.linalg.norm(ends[_next(one)] - ends[one], axis=1)
    areas, result = triangle_areas(mesh), np.unique(charts, return_inverse=True)[1]
    for _ in range(ROUNDS):
        target = _targets(result[one // 3], result[other // 3], lengths, np.bincount(result, areas), least * areas.sum())
        if np.array_equal(target, np.arange(len(target))):
            break
        result = np.unique(target[result], return_inverse=True)[1]
    return result


def _targets(one: np.ndarray, other: np.ndarray, lengths: np.ndarray, sizes: np.ndarray, least: float) -> np.ndarray:
    """(C,) chart that each chart joins, itself where it stays.  one, other : (P,) charts at each edge.  least : area of one that stays."""
    count, border = len(sizes), one != other
    both = np.concatenate([one[border] * count + other[border], other[border] * count + one[border]])
    pairs, place = np.unique(both, return_inverse=True)
    shared = np.bincount(place, np.tile(lengths[border], 2), len(pairs))
    small, neighbor = np.divmod(pairs, count)
    larger = (sizes[neighbor] > sizes[small]) | ((sizes[neighbor] == sizes[small]) & (neighbor < small))
    joins = larger & (sizes[small] < least)
    small, neighbor, shared = small[joins], neighbor[joins], shared[joins]
    order = np.lexsort((neighbor, -shared, small))
    first = order[np.unique(small[order], return_index=True)[1]]
    target = np.arange(count)
    target[small[first]] = neighbor[first]
    while not np.array_equal(target, target[target]):  # ends, as each chart joins a larger one
        target = target[target]
    return target


def flawed_charts(mesh: TriangleMesh, corners: np.ndarray, charts: np.ndarray) -> np.ndarray:
    """(C,) bool, charts that are stretched, folded or lie over themselves.  corners : (T, 3, 2) places.  charts : (T,) 0 to C - 1."""
    surface, areas = triangle_areas(mesh), signed_areas(corners)
    whole = np.bincount(charts, surface)
    folded = np.bincount(charts, surface * (areas <= 0), len(whole)) > MOST_FOLDED * whole
    fragments = rasterized(corners * CHECKED_SIZE, CHECKED_SIZE, CHECKED_SIZE)
    owner = charts[fragments.triangles]
    texels, count = np.unique(fragments.pixels.astype(np.int64) + owner * np.int64(CHECKED_SIZE**2), return_counts=True)
    shared = np.bincount(texels[count > 1] // CHECKED_SIZE**2, minlength=len(whole))
    return folded | (shared > MOST_SHARED * np.bincount(owner, minlength=len(whole))) | (stretches(mesh, corners, charts) > MOST_STRETCH)


def seams(mesh: TriangleMesh, charts: np.ndarray) -> np.ndarray:
    """(3 T,) bool, whether each half-edge has another chart, a boundary or more than one face on its other side."""
    one, other = _facing_pairs(mesh)
    inside = charts[one // 3] == charts[other // 3]
    result = np.ones(3 * len(mesh.triangles), bool)
    result[one[inside]] = result[other[inside]] = False
    return result


def _facing_pairs(mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """The two half-edges of each edge at which two triangles of one orientation meet."""
    table = HalfEdges.of(mesh)
    one, other = table.pairs.T
    facing = table.start[one] != table.start[other]
    return one[facing], other[facing]


def _next(half_edges: np.ndarray) -> np.ndarray:
    return half_edges - half_edges % 3 + (half_edges + 1) % 3


def _numbered(one: np.ndarray, other: np.ndarray, count: int) -> np.ndarray:
    return connected_components(np.column_stack([one, other]) // 3, count)[1]
