"""Splitting of long edges: the same surface with smaller triangles, where a capture has large ones."""

from __future__ import annotations

import numpy as np

from ..types import TriangleMesh
from .half_edges import HalfEdges
from .mesh import edge_lengths


def with_short_edges(mesh: TriangleMesh, longest: float) -> TriangleMesh:
    """The mesh with edges longer than `longest`, in scene units, split in the middle until there are none; neighbors stay joined.

    The mesh itself if it has none.
    """
    while True:
        table = HalfEdges.of(mesh)
        split = edge_lengths(mesh.vertices, table.edges) > longest
        if not split.any():
            return mesh
        mesh = split_edges(mesh, table, split)


def split_edges(mesh: TriangleMesh, table: HalfEdges, split: np.ndarray) -> TriangleMesh:
    """The mesh with new vertices in the middle of the edges marked in (E,) bool `split`, triangles divided accordingly.

    table : of the mesh. Triangles keep their order; each is replaced by one to four.
    """
    number = np.where(split, len(mesh.vertices) + np.cumsum(split) - 1, -1)[table.edge].reshape(-1, 3)
    vertices = np.concatenate([mesh.vertices, mesh.vertices[table.edges[split]].mean(axis=1)])
    first = np.argmax(_turned(number) @ [4, 2, 1], axis=1)  # so that the split edges of a triangle come first
    corners, middles = (np.take_along_axis(values, (first[:, None] + np.arange(3)) % 3, axis=1) for values in (mesh.triangles, number))
    count = (middles >= 0).sum(axis=1)
    (a, b, c), (ab, bc, ca) = corners.T, middles.T
    pieces = {
        0: [(a, b, c)],
        1: [(a, ab, c), (ab, b, c)],
        2: [(ab, b, bc), (a, ab, c), (ab, bc, c)],
        3: [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)],
    }
    chosen = [(np.flatnonzero(count == splits), piece) for splits, parts in pieces.items() for piece in parts]
    triangles = [np.column_stack([corner[rows] for corner in piece]) for rows, piece in chosen]
    owners = [rows for rows, _ in chosen]
    order = np.argsort(np.concatenate(owners), kind="stable")
    return TriangleMesh(vertices, np.concatenate(triangles)[order])


def _turned(number: np.ndarray) -> np.ndarray:
    """(T, 3, 3) bool, whether the edges of a triangle are split, listed from each of its corners on."""
    return np.stack([np.roll(number >= 0, -turn, axis=1) for turn in range(3)], axis=1)
