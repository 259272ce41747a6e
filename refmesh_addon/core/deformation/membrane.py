"""Small patches of a surface spanned like a membrane between the vertices around them."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.factor import factored
from ..geometry.graph import connected_components


def connected_patches(adjacency: sparse.csr_matrix, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices of the (R,) bool `chosen`, (N,) ascending, and the number of the connected patch of each, (N,) from 0 on."""
    vertices = np.flatnonzero(chosen)
    edges = np.column_stack(adjacency[vertices][:, vertices].nonzero())
    return vertices, connected_components(edges, len(vertices))[1]


def spanned(adjacency: sparse.csr_matrix, vertices: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """(N, 3) places of chosen vertices at which each is the mean of its neighbors; the others stay (Tutte 1963).

    adjacency : (R, R) of the mesh.  vertices : (R, 3).  chosen : (N,) indices, of which each connected patch has a neighbor that stays.
    """
    rows = (adjacency[chosen] != 0).astype(float)
    laplacian = sparse.diags(np.asarray(rows.sum(axis=1)).ravel()) - rows[:, chosen]
    fixed = np.ones(len(vertices), dtype=bool)
    fixed[chosen] = False
    return factored(laplacian).solve(rows @ (fixed[:, None] * vertices))
