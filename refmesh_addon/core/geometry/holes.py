"""Filling the holes of a capture, such as the soles that no camera saw, so that it encloses a volume."""

from __future__ import annotations

import numpy as np

from ..types import TriangleMesh
from .borders import boundary_edges
from .graph import connected_components


def capped(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh with each hole capped by a fan of triangles around its centroid; the mesh itself if it has no holes.

    Every edge then has as many triangles in one direction as in the other, so winding numbers are integers everywhere. Planar
    holes get planar caps. The vertices and triangles of the mesh come first, in their order.
    """
    open_edges = boundary_edges(mesh)
    if not len(open_edges):
        return mesh
    count = len(mesh.vertices)
    _, component = connected_components(open_edges, count)
    holes, hole = np.unique(component[open_edges[:, 0]], return_inverse=True)
    start, end = mesh.vertices[open_edges[:, 0]], mesh.vertices[open_edges[:, 1]]
    # Weighted by length, or many short edges on one side of a hole would pull its centroid there.
    length = np.linalg.norm(end - start, axis=1)
    weight = np.bincount(hole, length, len(holes))
    centroids = [np.bincount(hole, length * (start + end)[:, k] / 2, len(holes)) / np.where(weight > 0, weight, 1) for k in range(3)]
    fan = np.stack([open_edges[:, 1], open_edges[:, 0], count + hole], axis=1)
    return TriangleMesh(np.vstack([mesh.vertices, np.stack(centroids, axis=1)]), np.vstack([mesh.triangles, fan]))
