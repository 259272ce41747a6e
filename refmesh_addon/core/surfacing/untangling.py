"""Places where a surface crosses itself, smoothed until it does not."""

from __future__ import annotations

import numpy as np

from ..geometry.cotangent import neighbor_averages, triangle_adjacency
from ..geometry.mesh import triangles_at
from ..geometry.self_intersection import crossing_triangles, still_crossing
from ..types import TriangleMesh

ROUNDS = 11  # each reaches one more ring of vertices around what still crosses


def untangled(mesh: TriangleMesh, crossing: np.ndarray | None = None) -> TriangleMesh:
    """The mesh with vertices around crossings moved to the middle of their neighbors; the one with the fewest crossings counts.

    crossing : (T,) bool, which triangles cross others, where that is known already.
    """
    crossing = crossing_triangles(mesh) if crossing is None else crossing
    best, least = mesh, crossing.sum()
    links, loose = triangle_adjacency(mesh), np.zeros(len(mesh.vertices), dtype=bool)
    for _ in range(ROUNDS):
        if not crossing.any():
            break
        loose[mesh.triangles[crossing]] = True
        loose = loose | ((links @ loose) > 0)
        mesh = mesh.moved(np.where(loose[:, None], neighbor_averages(links, mesh.vertices), mesh.vertices))
        crossing = still_crossing(mesh, triangles_at(mesh, loose))
        if crossing.sum() < least:
            best, least = mesh, crossing.sum()
    return best
