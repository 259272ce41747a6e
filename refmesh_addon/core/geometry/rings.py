"""Vertices around others, ring by ring."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..types import TriangleMesh


def grown(adjacency: sparse.csr_matrix, chosen: np.ndarray, rings: int) -> np.ndarray:
    """(V,) bool, the (V,) bool chosen vertices and so many rings around them.  adjacency : (V, V) of the vertices."""
    for _ in range(rings):
        chosen = chosen | ((adjacency @ chosen) > 0)
    return chosen


def vertices_around(mesh: TriangleMesh, adjacency: sparse.csr_matrix, triangles: np.ndarray, rings: int) -> np.ndarray:
    """(V,) bool, the vertices of the (T,) bool triangles of a mesh and so many rings around them.  adjacency : (V, V) of its vertices."""
    corners = np.zeros(len(mesh.vertices), dtype=bool)
    corners[mesh.triangles[triangles]] = True
    return grown(adjacency, corners, rings)
