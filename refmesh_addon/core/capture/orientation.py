"""Consistent orientation: captures have flipped patches and, after some exports, bodies that are inside out."""

from __future__ import annotations

import numpy as np

from ..geometry.graph import connected_components
from ..geometry.half_edges import HalfEdges
from ..geometry.holes import capped
from ..geometry.mesh import component_volumes, triangle_areas, vertex_components
from ..types import TriangleMesh


def flipped_patches(mesh: TriangleMesh) -> np.ndarray:
    """(T,) bool, triangles to flip for neighbors to agree: in each connected surface, those on the side with the smaller area.

    Every triangle is two nodes of a graph, itself and itself flipped; an edge with two triangles joins the nodes that agree. Edges with
    more triangles join nothing, and a one-sided surface is left alone.
    """
    count, table = len(mesh.triangles), HalfEdges.of(mesh)
    first, second = table.pairs.T
    disagree = table.start[first] == table.start[second]  # consistent triangles run along their edge in opposite directions
    one, other = first // 3, second // 3
    as_they_are = np.column_stack([one, other + count * disagree])
    flipped = np.column_stack([one + count, other + count * ~disagree])
    _, label = connected_components(np.concatenate([as_they_are, flipped]), 2 * count)
    kept, reversed_ = label[:count], label[count:]
    area = np.bincount(kept, triangle_areas(mesh), label.max(initial=-1) + 1)
    return (area[kept] < area[reversed_]) | ((area[kept] == area[reversed_]) & (kept > reversed_))


def inside_out_bodies(mesh: TriangleMesh) -> np.ndarray:
    """(T,) bool, triangles of components that are inside out; one within the bounding box of another may be its cavity and is not."""
    count, label = vertex_components(mesh)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, label, mesh.vertices)
    np.maximum.at(high, label, mesh.vertices)
    inside_out = component_volumes(capped(mesh), label) < 0  # a cap's first corner is a vertex of the mesh, which has a label
    for component in np.flatnonzero(inside_out):
        enclosing = (low < low[component]).all(axis=1) & (high > high[component]).all(axis=1)
        inside_out[component] = not enclosing.any()
    return inside_out[label[mesh.triangles[:, 0]]]


def reoriented(mesh: TriangleMesh, flipped: np.ndarray) -> TriangleMesh:
    """The mesh with the triangles flipped that are True in a (T,) mask."""
    return TriangleMesh(mesh.vertices, np.where(flipped[:, None], mesh.triangles[:, ::-1], mesh.triangles))
