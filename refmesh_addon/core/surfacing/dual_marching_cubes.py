"""The zero surface of a trilinear function on a grid as an even triangle mesh, by the dual of marching cubes.

One vertex for each patch of surface in a cell, one quad for each crossed grid edge
(Nielson, "Dual marching cubes", IEEE Visualization 2004).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ..geometry.half_edges import HalfEdges
from ..types import TriangleMesh
from .sparse_grid import CORNERS, SparseGrid

PULL_STEPS = 2  # Newton steps; vertices lie within a fraction of a cell of the surface
BORDER = 0.02  # cells: how near to the side of its cell a vertex may come
MOST_CUTS = 20  # a cut may lay bare another bridge; two or three rounds end it
CUT = 0.01  # value outside that a cut node gets, as a share of the largest around it


def zero_surface(grid: SparseGrid, values: np.ndarray) -> TriangleMesh:
    """Triangles that face from positive to negative (N,) node values, on the zero set as far as it lies in cells of the grid."""
    values = _untangled(grid, values)
    places, quads, cells = _dual_quads(grid, values)
    low = grid.places(grid.cells[cells])
    for _ in range(PULL_STEPS):  # within its own cell, a vertex does not get past another sheet of the surface
        places = np.clip(places + _step_to_surface(grid, values, cells, places - low), low + BORDER, low + 1 - BORDER)
    vertices = grid.origin + grid.cell * places
    return TriangleMesh(vertices, split_quads(quads, vertices))


def _untangled(grid: SparseGrid, values: np.ndarray) -> np.ndarray:
    """Values whose surface is a manifold: where two sheets share an edge, a bridge thinner than a cell joins them and is cut."""
    for _ in range(MOST_CUTS):
        _, quads, cells = _dual_quads(grid, values)
        table = HalfEdges(quads, len(cells))
        shared = cells[table.edges[table.face_counts > 2]]
        if not len(shared):
            break
        values = values.copy()
        for first, second in shared:
            face = np.intersect1d(grid.corners[first], grid.corners[second])
            inside = face[values[face] > 0]
            values[inside[np.argmin(values[inside])] if len(inside) else face[:0]] = -CUT * np.abs(values[face]).max()
    return values


def _dual_quads(grid: SparseGrid, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (V, 3) in grid units, a quad of them for each grid edge that the surface crosses, (Q, 4), and the cell of each vertex."""
    inside = values > 0
    cases = inside[grid.corners] @ (1 << np.arange(8))
    owners, places, quads = [], [], []
    for axis in range(3):
        starts, ends = _crossed_edges(grid, inside, axis)
        place = grid.places(grid.nodes[starts]).astype(float)
        place[:, axis] += values[starts] / (values[starts] - values[ends])
        side, other = grid.strides[(axis + 1) % 3], grid.strides[(axis + 2) % 3]
        keys = grid.nodes[starts][:, None] - np.array([side + other, other, 0, side])  # counter-clockwise seen from the edge's far end
        cells = np.minimum(np.searchsorted(grid.cells, keys), len(grid.cells) - 1)
        whole = (grid.cells[cells] == keys).all(axis=1)
        around = (len(EDGES) * cells + patches()[cases[cells], 4 * axis + np.array([3, 2, 0, 1])])[whole]
        owners.append(around.ravel())
        places.append(np.repeat(place[whole], 4, axis=0))
        quads.append(np.where(inside[starts][whole, None], around, around[:, ::-1]))
    keys, owner = np.unique(np.concatenate(owners), return_inverse=True)
    place = np.concatenate(places)
    sums = np.column_stack([np.bincount(owner, weights=place[:, k], minlength=len(keys)) for k in range(3)])
    return sums / np.bincount(owner, minlength=len(keys))[:, None], np.searchsorted(keys, np.concatenate(quads)), keys // len(EDGES)


def _crossed_edges(grid: SparseGrid, inside: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the two nodes of each grid edge along an axis whose ends lie on different sides."""
    wanted = grid.nodes + grid.strides[axis]
    ends = np.minimum(np.searchsorted(grid.nodes, wanted), len(grid.nodes) - 1)
    starts = np.flatnonzero((grid.nodes[ends] == wanted) & (inside != inside[ends]))
    return starts, ends[starts]


def _step_to_surface(grid: SparseGrid, values: np.ndarray, cells: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """(V, 3) Newton step along the slope to the zero set, in grid units, from (V, 3) places in the given cells."""
    value, slope = grid.value_and_slope(values, cells, inside)
    return -value[:, None] * slope / np.maximum((slope**2).sum(axis=1, keepdims=True), np.finfo(float).tiny)


def split_quads(quads: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Each quad as two triangles along its shorter diagonal, (2 Q, 3)."""
    a, b, c, d = quads.T
    first = np.linalg.norm(vertices[a] - vertices[c], axis=1) <= np.linalg.norm(vertices[b] - vertices[d], axis=1)
    halves = np.where(first[:, None], np.column_stack([a, b, c, a, c, d]), np.column_stack([a, b, d, b, c, d]))
    return halves.reshape(-1, 3)


def _edge_ends(axis: int, a: int, b: int) -> frozenset[int]:
    start = a << (axis + 1) % 3 | b << (axis + 2) % 3
    return frozenset({start, start | 1 << axis})


# A cell's edge 4 * axis + a + 2 * b runs along that axis, at a along the next axis and b along the one after.
EDGES = [_edge_ends(axis, a, b) for axis in range(3) for b in (0, 1) for a in (0, 1)]
FACES = [frozenset(np.flatnonzero(CORNERS[:, axis] == end).tolist()) for axis in range(3) for end in (0, 1)]


@cache
def patches() -> np.ndarray:
    """(256, 12): for each pattern of inside corners, a number for each edge of the cell, equal where one patch of surface crosses both.

    A face with inside corners at opposite ends is cut so that these are apart; the two cells at the face agree on that.
    """
    table = np.empty((256, 12), dtype=np.int64)
    for case in range(256):
        inside = {corner for corner in range(8) if case >> corner & 1}
        patch = list(range(12))
        for face in FACES:
            crossed = [edge for edge, ends in enumerate(EDGES) if ends <= face and len(ends & inside) == 1]
            cut_off = [[edge for edge in crossed if corner in EDGES[edge]] for corner in face & inside]
            for group in cut_off if len(crossed) == 4 else [crossed]:
                joined = {patch[edge] for edge in group}
                patch = [min(joined) if number in joined else number for number in patch]
        table[case] = patch
    return table
