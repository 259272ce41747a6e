"""Coarse copies of dense meshes by vertex clustering (Rossignac and Borrel 1993): one vertex for all of a cell that face one way.

Far faster than edge collapses, and good for measuring, not for showing. What was closed stays closed: merging vertices changes the
borders of triangles for both sides alike, and triangles that fall onto each other cancel.
"""

from __future__ import annotations

import numpy as np

from ..types import TriangleMesh
from .mesh import triangle_areas, vertex_normals

CELLS_ON_SURFACE = 1.5  # that a surface crosses, on average, for each square of a cell's side
MOST_CELLS = 2**19  # along a side of the box, so that each has a number of 64 bits


def clustered(mesh: TriangleMesh, vertices: int) -> tuple[TriangleMesh, np.ndarray]:
    """The mesh with about so many vertices, or somewhat more, and the (T',) triangles of the mesh that its own come from.

    Sheets that face opposite ways stay two, however near they are.

    >>> coarse, kept = clustered(ball, 50)
    >>> len(coarse.vertices) < len(ball.vertices) and len(kept) == len(coarse.triangles)
    True
    """
    low, size = mesh.vertices.min(axis=0), float(np.ptp(mesh.vertices, axis=0).max())
    side = max(np.sqrt(CELLS_ON_SURFACE * triangle_areas(mesh).sum() / vertices), size / MOST_CELLS)
    cells = np.floor((mesh.vertices - low) / side).astype(np.int64)
    octants = (vertex_normals(mesh) > 0) @ np.array([1, 2, 4])
    keys = np.ravel_multi_index((*cells.T, octants), (*(cells.max(axis=0) + 1), 8))
    _, cluster, members = np.unique(keys, return_inverse=True, return_counts=True)
    middles = np.column_stack([np.bincount(cluster, column) for column in mesh.vertices.T]) / members[:, None]
    triangles = cluster[mesh.triangles]
    kept = _distinct(triangles)
    used, corners = np.unique(triangles[kept], return_inverse=True)
    return TriangleMesh(middles[used], corners.reshape(-1, 3)), kept


def _distinct(triangles: np.ndarray) -> np.ndarray:
    """Ascending numbers of (T, 3) triangles with three corners, one of those that are the same; none where as many are turned over."""
    proper = np.flatnonzero((triangles != np.roll(triangles, 1, axis=1)).all(axis=1))
    corners = triangles[proper]
    lowest = corners.argmin(axis=1)[:, None]
    turned = np.take_along_axis(corners, (lowest + [0, 1, 2]) % 3, axis=1)  # lowest first, which keeps the orientation
    side = np.where(turned[:, 1] < turned[:, 2], 1, -1)
    name = np.unique(np.column_stack([turned[:, 0], np.sort(turned[:, 1:], axis=1)]), axis=0, return_inverse=True)[1].ravel()
    left = np.flatnonzero(side * np.bincount(name, side)[name] > 0)
    return np.sort(proper[left[np.unique(name[left], return_index=True)[1]]])
