"""Triangles turned so that they face outward: captures have flipped patches and, after exports, bodies inside out."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from ..geometry.half_edges import HalfEdges
from ..geometry.holes import capped
from ..geometry.mesh import component_volumes, triangle_areas, vertex_components
from ..types import TriangleMesh


def flipped_patches(mesh: TriangleMesh) -> np.ndarray:
    """(T,) bool, triangles to turn so that neighbors agree; in each connected surface the smaller area turns.

    Every triangle stands for two nodes, itself and itself turned; an edge of two triangles links the nodes that agree.
    Edges of three or more triangles link nothing, and a surface with one side only is left alone.
    """
    count, table = len(mesh.triangles), HalfEdges.of(mesh)
    first, second = table.pairs.T
    against = table.start[first] == table.start[second]  # both run along the edge in one direction
    one, other = first // 3, second // 3
    links = np.concatenate([np.stack([one, other + count * against]), np.stack([one + count, other + count * ~against])], axis=1)
    _, side = csgraph.connected_components(sparse.coo_matrix((np.ones(links.shape[1]), tuple(links)), (2 * count,) * 2), directed=False)
    asis, turned = side[:count], side[count:]
    area = np.bincount(asis, triangle_areas(mesh), side.max() + 1)
    return (area[asis] < area[turned]) | ((area[asis] == area[turned]) & (asis > turned))


def inside_out_bodies(mesh: TriangleMesh) -> np.ndarray:
    """(T,) bool, triangles of the pieces that are inside out; one within the box of another may be its hollow and stays."""
    count, label = vertex_components(mesh)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, label, mesh.vertices)
    np.maximum.at(high, label, mesh.vertices)
    inside_out = component_volumes(capped(mesh), label) < 0  # the first corner of a cap is a vertex of the rim
    for k in np.flatnonzero(inside_out):
        inside_out[k] = not ((low < low[k]).all(axis=1) & (high > high[k]).all(axis=1)).any()
    return inside_out[label[mesh.triangles[:, 0]]]


def reoriented(mesh: TriangleMesh, chosen: np.ndarray) -> TriangleMesh:
    """The mesh with the triangles marked in (T,) `chosen` turned round."""
    return TriangleMesh(mesh.vertices, np.where(chosen[:, None], mesh.triangles[:, ::-1], mesh.triangles))
