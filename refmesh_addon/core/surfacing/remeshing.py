"""Remeshing: a surface with a given number of well-shaped triangles."""

from __future__ import annotations

from itertools import count

import numpy as np
from scipy.spatial import cKDTree

from ..errors import RefMeshError
from ..geometry.closest_point import SurfaceIndex
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import mean_edge_length
from ..geometry.self_intersection import crossing_triangles
from ..types import TriangleMesh
from .edge_collapse import collapsed
from .edge_flips import regularized

REACH = 2.0  # mean edge lengths around a self-intersection within which the surface is then left as it was
PATIENCE = 5  # attempts with that reach, which suffice on captures; each further one doubles it


def remeshed(mesh: TriangleMesh, triangles: int) -> TriangleMesh:
    """The closed surface with about `triangles` triangles: subdivided until it has as many, decimated, then regularized.

    Where the result would intersect itself, as between sheets closer than an edge, the triangles of `mesh` stay: two triangles of
    the result only cross if they are triangles of `mesh`, or of its subdivision, and cross there.
    Raises RefMeshError for a mesh without triangles.
    """
    if not len(mesh.triangles):
        raise RefMeshError("there is no surface to remesh: the mesh has no triangles")
    while len(mesh.triangles) < triangles:  # log4(triangles) rounds at most
        mesh = _subdivided(mesh)
    surface, tree, frozen = SurfaceIndex(mesh), cKDTree(mesh.vertices), np.zeros(len(mesh.vertices), dtype=bool)
    for attempt in count():  # ends: each attempt freezes at least one more vertex, and the reach doubles until it spans the mesh
        decimated, kept = collapsed(mesh, triangles, frozen)
        result = regularized(decimated, surface, frozen[kept])
        corners = np.unique(result.triangles[crossing_triangles(result)])
        if frozen[kept[corners]].all():
            break
        frozen[kept[corners]] = True
        reach = REACH * mean_edge_length(result) * 2.0 ** max(0, attempt + 1 - PATIENCE)
        for near in tree.query_ball_point(result.vertices[corners], reach):
            frozen[near] = True
    return result


def _subdivided(mesh: TriangleMesh) -> TriangleMesh:
    """Each triangle as four, with new vertices at the midpoints of its edges."""
    table = HalfEdges.of(mesh)
    ab, bc, ca = (len(mesh.vertices) + table.edge).reshape(-1, 3).T
    a, b, c = mesh.triangles.T
    vertices = np.concatenate([mesh.vertices, mesh.vertices[table.edges].mean(axis=1)])
    return TriangleMesh(vertices, np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3))
