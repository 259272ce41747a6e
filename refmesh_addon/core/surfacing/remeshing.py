"""A surface with a stated number of well-shaped triangles."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.closest_point import SurfaceIndex
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import mean_edge_length
from ..geometry.self_intersection import crossing_triangles
from ..types import TriangleMesh
from .edge_collapse import collapsed
from .edge_flips import regularized

TRIES = 5  # until nothing crosses; each leaves more as it was around what crossed
AROUND = 2.0  # edge lengths around a crossing that are left as they were


def remeshed(mesh: TriangleMesh, triangles: int) -> TriangleMesh:
    """The closed surface with about `triangles` triangles: reduced by quadric collapses, then regularized out.

    Where the result would cross itself though `mesh` does not, as between sheets nearer than an edge, `mesh` is kept.
    """
    while len(mesh.triangles) < triangles:
        mesh = _divided(mesh)
    surface, tree, frozen = SurfaceIndex(mesh), cKDTree(mesh.vertices), np.zeros(len(mesh.vertices), dtype=bool)
    for _ in range(TRIES):
        reduced, left = collapsed(mesh, triangles, frozen)
        found = regularized(reduced, surface, frozen[left])
        crossing = crossing_triangles(found)
        if not crossing.any():
            break
        corners = found.vertices[np.unique(found.triangles[crossing])]
        for near in tree.query_ball_point(corners, AROUND * mean_edge_length(found)):
            frozen[near] = True
    return found


def _divided(mesh: TriangleMesh) -> TriangleMesh:
    """Each triangle as four, with vertices in the middle of its edges."""
    table = HalfEdges.of(mesh)
    ab, bc, ca = (len(mesh.vertices) + table.edge).reshape(-1, 3).T
    a, b, c = mesh.triangles.T
    vertices = np.concatenate([mesh.vertices, mesh.vertices[table.edges].mean(axis=1)])
    return TriangleMesh(vertices, np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3))
