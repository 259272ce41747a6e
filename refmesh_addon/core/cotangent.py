"""Cotangent weights of a triangle mesh, bounded so that slivers cannot spoil an energy built on them."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from .geometry import TINY
from .types import TriangleMesh

# A corner below about 3 degrees (or above 177) counts as one of 3 degrees: a needle's cotangent is otherwise unbounded.
CORNER_LIMIT = 20.0
# Least weight of an edge; an equilateral mesh has 0.58. Negative sums (edges that are not Delaunay) would let the
# energy fall without end, and zero would cut the mesh apart where its triangles are joined.
EDGE_FLOOR = 0.01


def cotangent_weights(mesh: TriangleMesh) -> sparse.csr_matrix:
    """Symmetric (V, V) matrix of w_ij = (cot a + cot b) / 2 over the corners opposite to edge ij (Pinkall & Polthier 1993).

    No unit: scaling the mesh keeps the weights. Corners and edges are bounded by CORNER_LIMIT and EDGE_FLOOR; nothing
    changes in a Delaunay mesh without needles. Boundary edges have one corner, vertices without triangles no entry.
    """
    corners = mesh.triangles
    positions = mesh.vertices[corners]
    rows, columns, weights = [], [], []
    for k in range(3):
        tip, left, right = positions[:, k], positions[:, k - 2], positions[:, k - 1]
        u, v = left - tip, right - tip
        sine = np.linalg.norm(np.cross(u, v), axis=1)
        cotangent = np.einsum("ij,ij->i", u, v) / np.maximum(sine, TINY)
        weights.append(0.5 * np.clip(cotangent, -CORNER_LIMIT, CORNER_LIMIT))
        rows.append(corners[:, k - 2])
        columns.append(corners[:, k - 1])
    return _symmetric(np.concatenate(rows), np.concatenate(columns), np.concatenate(weights), len(mesh.vertices))


def triangle_adjacency(mesh: TriangleMesh) -> sparse.csr_matrix:
    """Symmetric (V, V) matrix: half the number of triangles along each edge, 1 inside and 1/2 on the boundary."""
    rows, columns = mesh.triangles.ravel(), mesh.triangles[:, [1, 2, 0]].ravel()
    half = sparse.coo_matrix((np.full(len(rows), 0.5), (rows, columns)), shape=(len(mesh.vertices),) * 2).tocsr()
    return half + half.T


def _symmetric(rows: np.ndarray, columns: np.ndarray, weights: np.ndarray, count: int) -> sparse.csr_matrix:
    upper = sparse.coo_matrix((weights, (np.minimum(rows, columns), np.maximum(rows, columns))), shape=(count, count)).tocsr()
    upper.data = np.maximum(upper.data, EDGE_FLOOR)
    return (upper + upper.T).tocsr()
