"""Cotangent weights of a triangle mesh, bounded so that slivers cannot spoil an energy built on them."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..types import TriangleMesh
from .vectors import TINY, row_dot

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
        cotangent = row_dot(u, v) / np.maximum(sine, TINY)
        weights.append(0.5 * np.clip(cotangent, -CORNER_LIMIT, CORNER_LIMIT))
        rows.append(corners[:, k - 2])
        columns.append(corners[:, k - 1])
    return _symmetric(np.concatenate(rows), np.concatenate(columns), np.concatenate(weights), len(mesh.vertices))


def spokes(weights: sparse.csr_matrix, rest: np.ndarray) -> sparse.csr_matrix:
    """(3 V, V) matrix that turns positions into covariance sums over the edges at each vertex.

    weights : (V, V) symmetric.  rest : (V, 3) positions p. Times positions p' it gives, in rows 3 i to 3 i + 2, the
    transpose of sum over j of w_ij (p'_i - p'_j)(p_i - p_j)^T; its own transpose takes rotations to the right side of
    the global step.
    """
    count = len(rest)
    start = np.repeat(np.arange(count), np.diff(weights.indptr))
    edges = weights.data[:, None] * (rest[start] - rest[weights.indices])
    one_axis = []
    for axis in range(3):
        across = sparse.csr_matrix((edges[:, axis], weights.indices, weights.indptr), shape=weights.shape)
        one_axis.append(sparse.diags(np.asarray(across.sum(axis=1)).ravel()) - across)
    interleaved = np.arange(3 * count).reshape(3, count).T.ravel()
    return sparse.vstack(one_axis).tocsr()[interleaved]


def triangle_adjacency(mesh: TriangleMesh) -> sparse.csr_matrix:
    """Symmetric (V, V) matrix: half the number of triangles along each edge, 1 inside and 1/2 on the boundary."""
    rows, columns = mesh.triangles.ravel(), mesh.triangles[:, [1, 2, 0]].ravel()
    half = sparse.coo_matrix((np.full(len(rows), 0.5), (rows, columns)), shape=(len(mesh.vertices),) * 2).tocsr()
    return half + half.T


def neighbor_averages(links: sparse.csr_matrix, vertices: np.ndarray) -> np.ndarray:
    """(V, 3) middle of the neighbours of each of (V, 3) vertices.  links : (V, V) weights, as `triangle_adjacency` gives them."""
    return links @ vertices / np.maximum(np.asarray(links.sum(axis=1)), TINY)


def _symmetric(rows: np.ndarray, columns: np.ndarray, weights: np.ndarray, count: int) -> sparse.csr_matrix:
    upper = sparse.coo_matrix((weights, (np.minimum(rows, columns), np.maximum(rows, columns))), shape=(count, count)).tocsr()
    upper.data = np.maximum(upper.data, EDGE_FLOOR)
    return (upper + upper.T).tocsr()
