"""Stitching of seams whose two sides do not quite coincide: exporters round each side separately, and some displace it slightly.

Left open, each chart of a texture atlas would be a sheet of its own, and the body would enclose next to nothing.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.borders import boundary_edges
from ..geometry.graph import connected_components
from ..geometry.mesh import merged
from ..types import TriangleMesh

LARGEST_GAP = 1e-4  # that is closed, as a share of the diagonal ...
EDGE_SHARE = 0.1  # ... and of the shortest boundary edge at either vertex, so that the rims of thin slits keep their shape


def stitched(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh with boundary vertices joined across tiny gaps; the mesh itself if there are none.

    mesh : coincident vertices merged. Of vertices that are joined, the first keeps its position.
    """
    edges = boundary_edges(mesh)
    boundary = np.unique(edges)
    if not len(boundary):
        return mesh
    pairs = boundary[cKDTree(mesh.vertices[boundary]).query_pairs(LARGEST_GAP * mesh.diagonal, output_type="ndarray")]
    pairs = pairs[_lengths(mesh, pairs) <= EDGE_SHARE * _shortest_edges(mesh, edges)[pairs].min(axis=1)]
    if not len(pairs):
        return mesh
    _, label = connected_components(pairs, len(mesh.vertices))
    first = np.unique(label, return_index=True)[1]
    return merged(TriangleMesh(mesh.vertices, first[label][mesh.triangles]))[0]


def _shortest_edges(mesh: TriangleMesh, edges: np.ndarray) -> np.ndarray:
    """(V,) length of the shortest of (E, 2) edges at each vertex, inf where it has none."""
    result = np.full(len(mesh.vertices), np.inf)
    np.minimum.at(result, edges, _lengths(mesh, edges)[:, None])
    return result


def _lengths(mesh: TriangleMesh, pairs: np.ndarray) -> np.ndarray:
    return np.linalg.norm(mesh.vertices[pairs[:, 0]] - mesh.vertices[pairs[:, 1]], axis=1)
