"""Places where a surface crosses itself, smoothed until it does not."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from .cotangent import triangle_adjacency
from .self_intersection import crossing_triangles
from .types import TriangleMesh

ROUNDS = 12  # each reaches one more ring of vertices around what still crosses


def untangled(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh with vertices around crossings moved to the middle of their neighbours; the one with the fewest crossings counts."""
    links = triangle_adjacency(mesh)
    middle = sparse.diags(1.0 / np.maximum(np.asarray(links.sum(axis=1)).ravel(), 1.0)) @ links
    best, least, loose = mesh, np.inf, np.zeros(len(mesh.vertices), dtype=bool)
    for _ in range(ROUNDS):
        crossing = crossing_triangles(mesh)
        if crossing.sum() < least:
            best, least = mesh, crossing.sum()
        if not crossing.any():
            break
        loose[mesh.triangles[crossing]] = True
        loose = loose | ((links @ loose) > 0)
        mesh = mesh.moved(np.where(loose[:, None], middle @ mesh.vertices, mesh.vertices))
    return best
