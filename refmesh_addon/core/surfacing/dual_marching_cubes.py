"""Dual marching cubes: the zero set of a trilinear function on a grid as a mesh of evenly sized triangles.

One vertex for each patch of surface in a cell, one quad for each grid edge that the surface crosses (Nielson, "Dual marching cubes",
IEEE Visualization 2004).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ..geometry.half_edges import HalfEdges
from ..geometry.vectors import TINY
from ..types import TriangleMesh
from .sparse_grid import CORNERS, SparseGrid

NEWTON_STEPS = 2  # toward the zero set, from which vertices start a fraction of a cell away
MARGIN = 0.02  # cells: least distance of a vertex from the faces of its cell
MOST_CUTS = 20  # rounds of cuts, each of which may expose another bridge; two or three are enough
CUT = 0.01  # value that puts a node outside, as a share of the largest on its face


def zero_surface(grid: SparseGrid, values: np.ndarray) -> TriangleMesh:
    """Triangles that face from positive to negative (N,) node values, on the part of the zero set within cells of the grid."""
    values = _without_bridges(grid, values)
    positions, quads, cells = _dual_quads(grid, values)
    low = grid.coordinates(grid.cells[cells])
    for _ in range(NEWTON_STEPS):  # staying in its cell, a vertex cannot pass another sheet of the surface
        positions = np.clip(positions + _newton_step(grid, values, cells, positions - low), low + MARGIN, low + 1 - MARGIN)
    vertices = grid.origin + grid.cell * positions
    return TriangleMesh(vertices, split_quads(quads, vertices))


def _without_bridges(grid: SparseGrid, values: np.ndarray) -> np.ndarray:
    """(N,) values whose zero set is a manifold: where two sheets share an edge, the bridge thinner than a cell that joins them is cut."""
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
    """Vertices (V, 3) in cells, a quad of them for each grid edge that the surface crosses, (Q, 4), and the cell of each vertex, (V,)."""
    inside = values > 0
    cases = inside[grid.corners] @ (1 << np.arange(8))
    owners, points, quads = [], [], []
    for axis in range(3):
        starts, ends = _crossed_edges(grid, inside, axis)
        point = grid.coordinates(grid.nodes[starts]).astype(float)
        point[:, axis] += values[starts] / (values[starts] - values[ends])
        side, other = grid.strides[(axis + 1) % 3], grid.strides[(axis + 2) % 3]
        keys = grid.nodes[starts][:, None] - np.array([side + other, other, 0, side])  # counter-clockwise seen from the end of the edge
        cells = np.minimum(np.searchsorted(grid.cells, keys), len(grid.cells) - 1)
        whole = (grid.cells[cells] == keys).all(axis=1)
        around = (len(EDGES) * cells + patches()[cases[cells], 4 * axis + np.array([3, 2, 0, 1])])[whole]
        owners.append(around.ravel())
        points.append(np.repeat(point[whole], 4, axis=0))
        quads.append(np.where(inside[starts][whole, None], around, around[:, ::-1]))
    keys, owner = np.unique(np.concatenate(owners), return_inverse=True)
    point = np.concatenate(points)
    sums = np.column_stack([np.bincount(owner, weights=point[:, k], minlength=len(keys)) for k in range(3)])
    return sums / np.bincount(owner, minlength=len(keys))[:, None], np.searchsorted(keys, np.concatenate(quads)), keys // len(EDGES)


def _crossed_edges(grid: SparseGrid, inside: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Start and end nodes, as indices, of the grid edges along an axis whose ends lie on different sides of the surface."""
    next_keys = grid.nodes + grid.strides[axis]
    ends = np.minimum(np.searchsorted(grid.nodes, next_keys), len(grid.nodes) - 1)
    starts = np.flatnonzero((grid.nodes[ends] == next_keys) & (inside != inside[ends]))
    return starts, ends[starts]


def _newton_step(grid: SparseGrid, values: np.ndarray, cells: np.ndarray, local: np.ndarray) -> np.ndarray:
    """(V, 3) Newton step along the gradient toward the zero set, in cells, from (V, 3) local coordinates in cells of (V,) indices."""
    value, gradient = grid.value_and_gradient(values, cells, local)
    return -value[:, None] * gradient / np.maximum((gradient**2).sum(axis=1, keepdims=True), TINY)


def split_quads(quads: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """(2 Q, 3) triangles: each of (Q, 4) quads split along its shorter diagonal."""
    a, b, c, d = quads.T
    shorter = np.linalg.norm(vertices[a] - vertices[c], axis=1) <= np.linalg.norm(vertices[b] - vertices[d], axis=1)
    halves = np.where(shorter[:, None], np.column_stack([a, b, c, a, c, d]), np.column_stack([a, b, d, b, c, d]))
    return halves.reshape(-1, 3)


def _edge_ends(axis: int, a: int, b: int) -> frozenset[int]:
    start = a << (axis + 1) % 3 | b << (axis + 2) % 3
    return frozenset({start, start | 1 << axis})


# Edge 4 axis + a + 2 b of a cell runs along that axis, at coordinate a of the next axis and b of the one after.
EDGES = [_edge_ends(axis, a, b) for axis in range(3) for b in (0, 1) for a in (0, 1)]
FACES = [frozenset(np.flatnonzero(CORNERS[:, axis] == end).tolist()) for axis in range(3) for end in (0, 1)]


@cache
def patches() -> np.ndarray:
    """(256, 12) numbers of the edges of a cell for each pattern of inside corners, equal where the same patch of surface crosses them.

    On an ambiguous face, with two inside corners diagonally opposite, these are separated, in both cells at the face.
    """
    table = np.empty((256, 12), dtype=np.int64)
    for case in range(256):
        inside = {corner for corner in range(8) if case >> corner & 1}
        patch = list(range(12))
        for face in FACES:
            crossed = [edge for edge, ends in enumerate(EDGES) if ends <= face and len(ends & inside) == 1]
            around_each = [[edge for edge in crossed if corner in EDGES[edge]] for corner in face & inside]
            for group in around_each if len(crossed) == 4 else [crossed]:
                joined = {patch[edge] for edge in group}
                patch = [min(joined) if number in joined else number for number in patch]
        table[case] = patch
    return table
