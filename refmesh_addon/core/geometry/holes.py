"""Closing the holes of a capture, such as soles that no camera saw, so that it encloses a volume."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from ..types import TriangleMesh
from .borders import boundary_edges


def capped(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh with a fan of triangles about the middle of each hole; the mesh itself where it has none.

    Every edge then has as many triangles along it one way as the other, so winding numbers are whole everywhere. Flat
    holes get flat caps. Vertices and triangles of the mesh come first, in their order.
    """
    open_edges = boundary_edges(mesh)
    if not len(open_edges):
        return mesh
    count = len(mesh.vertices)
    graph = sparse.coo_matrix((np.ones(len(open_edges)), tuple(open_edges.T)), shape=(count, count))
    _, component = csgraph.connected_components(graph, directed=False)
    holes, hole = np.unique(component[open_edges[:, 0]], return_inverse=True)
    start, end = mesh.vertices[open_edges[:, 0]], mesh.vertices[open_edges[:, 1]]
    # Weighted by length: where a hole's rim has many small edges must not pull its middle there.
    length = np.linalg.norm(end - start, axis=1)
    weight = np.bincount(hole, length, len(holes))
    middles = [np.bincount(hole, length * (start + end)[:, k] / 2, len(holes)) / np.where(weight > 0, weight, 1) for k in range(3)]
    fan = np.stack([open_edges[:, 1], open_edges[:, 0], count + hole], axis=1)
    return TriangleMesh(np.vstack([mesh.vertices, np.stack(middles, axis=1)]), np.vstack([mesh.triangles, fan]))
