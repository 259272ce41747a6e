"""Closing seams whose two sides do not quite coincide: exporters round each side by itself, and some move it by a hair.

Left open, each chart of a texture atlas would be a sheet of its own, and the body would enclose next to nothing.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph
from scipy.spatial import cKDTree

from ..geometry.borders import boundary_edges
from ..geometry.mesh import merged
from ..types import TriangleMesh

HAIR = 1e-4  # greatest gap that is closed, as a share of the diagonal ...
SHORT = 0.1  # ... and of the shortest open edge at either vertex: rims of thin slits keep their shape


def stitched(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh with vertices of open edges joined where they are a hair apart; the mesh itself where there are none.

    mesh : coincident vertices merged. Of vertices that are joined the first keeps its place.
    """
    ends = boundary_edges(mesh)
    rim = np.unique(ends)
    if not len(rim):
        return mesh
    length = np.linalg.norm(mesh.vertices[ends[:, 0]] - mesh.vertices[ends[:, 1]], axis=1)
    shortest = np.full(len(mesh.vertices), np.inf)
    np.minimum.at(shortest, ends, length[:, None])
    pairs = rim[cKDTree(mesh.vertices[rim]).query_pairs(HAIR * mesh.diagonal, output_type="ndarray")]
    gap = np.linalg.norm(mesh.vertices[pairs[:, 0]] - mesh.vertices[pairs[:, 1]], axis=1)
    pairs = pairs[gap <= SHORT * shortest[pairs].min(axis=1)]
    if not len(pairs):
        return mesh
    count = len(mesh.vertices)
    links = sparse.coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    _, label = csgraph.connected_components(links, directed=False)
    first = np.unique(label, return_index=True)[1]
    return merged(TriangleMesh(mesh.vertices, first[label][mesh.triangles]))[0]
