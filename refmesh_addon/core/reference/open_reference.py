"""The reference mesh of an open take: the union of what its frames show, open where none shows anything."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from ..errors import RefMeshError
from ..geometry.mesh import submesh, triangle_areas, vertex_components, vertex_normals
from ..geometry.vectors import row_dot
from ..geometry.vertex_smoothing import VertexSmoother
from ..surfacing.cutting import cut_at_zero
from ..types import TriangleMesh
from .group import ReferenceMesh, build_reference
from .union_points import UnionPoints

NEIGHBORS = 8  # points by which a vertex is judged to lie on what frames show
FACING = 0.3  # least cosine between the normals of a vertex and of a point that says something about it
SMOOTHING = 4  # steps in which the course of the border is smoothed
LEAST_PIECE = 0.005  # share of the area below which a piece of the cut surface is a leftover
SHOWN = 0.5  # share of the points of a cell that frames show, from which on it belongs to the surface


def build_open_reference(
    union: UnionPoints,
    spacing: float,
    triangles: int,
    depth: int,
    reconstruct: Callable[[np.ndarray, np.ndarray, int], TriangleMesh],
    is_open: bool,
) -> ReferenceMesh:
    """`build_reference` from the union of an open take, or from the points of bodies whose holes are left open.

    triangles : before anything is cut away.  is_open : whether what closes the frames is cut away again; a layer stays closed.
    The other arguments as there.
    Raises RefMeshError when nothing is left.
    """
    if not is_open:
        return build_reference(union.points, union.normals, spacing, triangles, depth, reconstruct)
    closed = build_reference(union.points, union.normals, spacing, triangles, depth, reconstruct)
    mesh = without_leftovers(cut_open(closed.mesh, union))
    if not len(mesh.triangles):
        raise RefMeshError("no part of the reference mesh lies near what the frames show: take more --centers or a smaller --group-size")
    return ReferenceMesh(mesh, closed.self_intersections)


def cut_open(mesh: TriangleMesh, union: UnionPoints) -> TriangleMesh:
    """The part of a closed surface that lies on what frames show."""
    return cut_at_zero(mesh, VertexSmoother(mesh).smoothed(_shown(mesh, union), SMOOTHING))


def without_leftovers(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh without connected pieces of hardly any area."""
    count, label = vertex_components(mesh)
    piece = label[mesh.triangles[:, 0]]
    area = np.bincount(piece, triangle_areas(mesh), count)
    return submesh(mesh, (area >= LEAST_PIECE * area.sum())[piece])[0]


def _shown(mesh: TriangleMesh, union: UnionPoints) -> np.ndarray:
    """(V,) from -1 where the points around a vertex close the frames to 1 where frames show it, by nearness."""
    distances, near = cKDTree(union.points).query(mesh.vertices, k=min(NEIGHBORS, len(union.points)))
    normals = vertex_normals(mesh)
    weights = np.stack([row_dot(normals, union.normals[near[:, rank]]) > FACING for rank in range(near.shape[1])], axis=1)
    weights = weights / np.maximum(distances, 1e-3 * np.median(distances)) ** 2
    total = weights.sum(axis=1)
    signs = 2.0 * (union.shown[near] - SHOWN)
    return np.where(total > 0, (weights * signs).sum(axis=1) / np.where(total > 0, total, 1.0), -1.0)
