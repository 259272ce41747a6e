"""Untangling: a surface is smoothed where it intersects itself, until it does not."""

from __future__ import annotations

import numpy as np

from ..geometry.cotangent import neighbor_averages, triangle_adjacency
from ..geometry.mesh import triangles_at
from ..geometry.rings import grown
from ..geometry.self_intersection import crossing_triangles, still_crossing
from ..types import TriangleMesh

ROUNDS = 11  # each includes one more ring of vertices around what still crosses


def untangled(mesh: TriangleMesh, crossing: np.ndarray | None = None) -> TriangleMesh:
    """The mesh with the vertices around crossings moved to the mean of their neighbors, at the round that left the fewest crossings.

    crossing : (T,) bool from `crossing_triangles`, if that is known already.
    """
    crossing = crossing_triangles(mesh) if crossing is None else crossing
    best, least = mesh, crossing.sum()
    adjacency, loose = triangle_adjacency(mesh), np.zeros(len(mesh.vertices), dtype=bool)
    for _ in range(ROUNDS):
        if not crossing.any():
            break
        loose[mesh.triangles[crossing]] = True
        loose = grown(adjacency, loose, 1)
        mesh = mesh.moved(np.where(loose[:, None], neighbor_averages(adjacency, mesh.vertices), mesh.vertices))
        crossing = still_crossing(mesh, triangles_at(mesh, loose))
        if crossing.sum() < least:
            best, least = mesh, crossing.sum()
    return best
