"""Cutting a surface along the zero level of a function on its vertices: the border runs across triangles, not along their edges."""

from __future__ import annotations

import numpy as np

from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import submesh
from ..types import TriangleMesh

SNAP = 0.3  # share of an edge within which a vertex moves to the cut, so that no slivers come about


def cut_at_zero(mesh: TriangleMesh, values: np.ndarray) -> TriangleMesh:
    """The part of a surface where a function is positive.

    values : (V,) of the function at the vertices, linear in each triangle.
    """
    mesh, values = _snapped(mesh, values)
    sides = np.sign(values)[mesh.triangles]
    kept = mesh.triangles[(sides >= 0).all(axis=1) & (sides > 0).any(axis=1)]
    mixed = np.flatnonzero((sides > 0).any(axis=1) & (sides < 0).any(axis=1))
    table = HalfEdges(mesh.triangles, len(mesh.vertices))
    start, end = table.edges.T
    crossed = values[start] * values[end] < 0
    number = np.cumsum(crossed) - 1 + len(mesh.vertices)
    share = (values[start] / np.where(crossed, values[start] - values[end], 1.0))[crossed, None]
    added = mesh.vertices[start[crossed]] + share * (mesh.vertices[end[crossed]] - mesh.vertices[start[crossed]])
    middle = np.where(crossed, number, -1)[table.edge].reshape(-1, 3)[mixed]  # of the edge from each corner to the next
    pieces = _positive_parts(mesh.triangles[mixed], sides[mixed], middle)
    return submesh(TriangleMesh(np.concatenate([mesh.vertices, added]), np.concatenate([kept, pieces])))[0]


def _positive_parts(triangles: np.ndarray, sides: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """(K, 3) triangles that make up the positive parts of those that the cut crosses.

    sides : (T, 3) signs of the corners.  middle : (T, 3) vertex on the edge from each corner to the next, -1 where it is not crossed.
    """
    parts = []
    for turn in range(3):
        a, b, c = (np.roll(triangles, -turn, axis=1)).T
        p, q, r = np.roll(sides, -turn, axis=1).T
        ab, bc, ca = np.roll(middle, -turn, axis=1).T
        one, two = (p > 0) & (q < 0) & (r < 0), (p < 0) & (q > 0) & (r > 0)
        left, right = (p == 0) & (q > 0) & (r < 0), (p == 0) & (q < 0) & (r > 0)
        parts += [np.column_stack(rows)[chosen] for rows, chosen in (((a, ab, ca), one), ((ab, b, c), two), ((ab, c, ca), two))]
        parts += [np.column_stack(rows)[chosen] for rows, chosen in (((a, b, bc), left), ((a, bc, c), right))]
    return np.concatenate(parts)


def _snapped(mesh: TriangleMesh, values: np.ndarray) -> tuple[TriangleMesh, np.ndarray]:
    """Vertices next to the cut moved onto it, along their edge that it crosses nearest to them."""
    start, end = HalfEdges.of(mesh).edges.T
    crossed = values[start] * values[end] < 0
    start, end = np.concatenate([start[crossed], end[crossed]]), np.concatenate([end[crossed], start[crossed]])
    share = values[start] / (values[start] - values[end])
    order = np.lexsort((end, share, start))
    first = order[np.unique(start[order], return_index=True)[1]]
    first = first[share[first] < SNAP]
    vertices, values = mesh.vertices.copy(), values.copy()
    vertices[start[first]] += share[first, None] * (vertices[end[first]] - vertices[start[first]])
    values[start[first]] = 0.0
    return mesh.moved(vertices), values
