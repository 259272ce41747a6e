"""Cotangent weights of a triangle mesh, bounded so that slivers do not dominate an energy built on them."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..types import TriangleMesh
from .vectors import TINY, row_dot

# An angle below about 3 degrees (or above 177) counts as 3 degrees: the cotangents of needles are otherwise unbounded.
CORNER_LIMIT = 20.0
# Smallest weight of an edge; in an equilateral mesh it is 0.58. With negative sums (edges that are not Delaunay) the energy would have
# no minimum, and with zero the mesh would come apart at edges that join its triangles.
EDGE_FLOOR = 0.01


def cotangent_weights(mesh: TriangleMesh) -> sparse.csr_matrix:
    """Symmetric (V, V) matrix of w_ij = (cot a + cot b) / 2 over the angles opposite to edge ij (Pinkall & Polthier 1993).

    No unit: scaling the mesh keeps the weights. CORNER_LIMIT and EDGE_FLOOR bound them, which changes nothing in a Delaunay mesh
    without needles. Boundary edges have one angle, vertices without triangles no entry.
    """
    corners = mesh.triangles
    positions = mesh.vertices[corners]
    rows, columns, weights = [], [], []
    for k in range(3):
        apex, left, right = positions[:, k], positions[:, k - 2], positions[:, k - 1]
        u, v = left - apex, right - apex
        sine = np.linalg.norm(np.cross(u, v), axis=1)
        cotangent = row_dot(u, v) / np.maximum(sine, TINY)
        weights.append(0.5 * np.clip(cotangent, -CORNER_LIMIT, CORNER_LIMIT))
        rows.append(corners[:, k - 2])
        columns.append(corners[:, k - 1])
    return _symmetric(np.concatenate(rows), np.concatenate(columns), np.concatenate(weights), len(mesh.vertices))


def spokes(weights: sparse.csr_matrix, rest: np.ndarray) -> sparse.csr_matrix:
    """(3 V, V) matrix that maps positions to the covariances of the edges at each vertex (Sorkine & Alexa 2007, equation 5).

    weights : (V, V) symmetric.  rest : (V, 3) positions p. Applied to positions p', it gives in rows 3 i to 3 i + 2 the transpose of
    the sum over j of w_ij (p'_i - p'_j)(p_i - p_j)^T. Its transpose maps rotations to the right-hand side of the global step.
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
    """Symmetric (V, V) matrix with half the number of triangles at each edge: 1 in the interior, 1/2 on the boundary."""
    rows, columns = mesh.triangles.ravel(), mesh.triangles[:, [1, 2, 0]].ravel()
    half = sparse.coo_matrix((np.full(len(rows), 0.5), (rows, columns)), shape=(len(mesh.vertices),) * 2).tocsr()
    return half + half.T


def neighbor_averages(adjacency: sparse.csr_matrix, vertices: np.ndarray) -> np.ndarray:
    """(V, 3) weighted mean of the neighbors of each of (V, 3) vertices.  adjacency : (V, V) weights, as from `triangle_adjacency`."""
    return adjacency @ vertices / np.maximum(np.asarray(adjacency.sum(axis=1)), TINY)


def _symmetric(rows: np.ndarray, columns: np.ndarray, weights: np.ndarray, count: int) -> sparse.csr_matrix:
    upper = sparse.coo_matrix((weights, (np.minimum(rows, columns), np.maximum(rows, columns))), shape=(count, count)).tocsr()
    upper.data = np.maximum(upper.data, EDGE_FLOOR)
    return (upper + upper.T).tocsr()
