"""Self-intersections: triangles of a mesh that cross each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from ..types import TriangleMesh
from .half_edges import HalfEdges
from .mesh import submesh
from .vectors import row_dot

BLOCK = 20_000  # edges tested at a time, which bounds the memory


def crossing_triangles(mesh: TriangleMesh) -> np.ndarray:
    """(T,) bool, whether a triangle crosses another one; sharing a vertex or an edge does not count.

    Two triangles cross where an edge of one pierces the other. Edges are not tested against triangles that share a vertex with them.
    """
    table, vertices = HalfEdges.of(mesh), mesh.vertices - mesh.vertices.mean(axis=0)
    pierced, piercing = np.zeros(len(mesh.triangles), dtype=bool), np.zeros(len(table.edges), dtype=bool)
    for edge, triangle in _near(vertices, table.edges, mesh.triangles):
        ends, corners = table.edges[edge].T, mesh.triangles[triangle].T
        apart = np.logical_and.reduce([end != corner for end in ends for corner in corners])
        edge, triangle = edge[apart], triangle[apart]
        hit = _pierces(vertices[table.edges[edge]], vertices[mesh.triangles[triangle]])
        pierced[triangle[hit]], piercing[edge[hit]] = True, True
    return pierced | piercing[table.edge].reshape(-1, 3).any(axis=1)


def still_crossing(mesh: TriangleMesh, changed: np.ndarray) -> np.ndarray:
    """(T,) bool, as `crossing_triangles` returns, for a mesh in which every crossing involves one of the (T,) bool changed triangles.

    Only these and their surroundings are tested: few of many where a surface is repaired.
    """
    result = np.zeros(len(mesh.triangles), dtype=bool)
    if changed.any():
        centers, radii = _bounding_spheres(mesh.vertices, mesh.triangles)
        distance, _ = cKDTree(centers[changed]).query(centers, distance_upper_bound=2 * radii.max())
        near = distance <= radii + radii[changed].max()
        result[near] = crossing_triangles(submesh(mesh, near)[0])
    return result


def _near(vertices: np.ndarray, edges: np.ndarray, triangles: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yields blocks of pairs (edge, triangle), (K,) each, whose bounding spheres meet."""
    centers, radii = _bounding_spheres(vertices, triangles)
    midpoints, halves = _bounding_spheres(vertices, edges)
    for triangle_class in _size_classes(radii):
        tree, reach = cKDTree(centers[triangle_class]), radii[triangle_class].max()
        for edge_class in _size_classes(halves):
            for start in range(0, len(edge_class), BLOCK):
                block = edge_class[start : start + BLOCK]
                nearby = cKDTree(midpoints[block]).sparse_distance_matrix(tree, reach + halves[block].max(), output_type="coo_matrix")
                edge, triangle = block[nearby.row], triangle_class[nearby.col]
                near = nearby.data <= halves[edge] + radii[triangle]
                yield edge[near], triangle[near]


def _bounding_spheres(vertices: np.ndarray, elements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centroid (N, 3) of (N, K) triangles or edges, and the distance (N,) of their farthest vertex from it."""
    corners = [vertices.take(corner, axis=0) for corner in elements.T]
    centroids = sum(corners[1:], corners[0]) / len(corners)
    return centroids, np.maximum.reduce([np.linalg.norm(corner - centroids, axis=1) for corner in corners])


def _size_classes(sizes: np.ndarray) -> list[np.ndarray]:
    """Indices of the sizes between each two powers of two: one long edge then does not widen the search for all."""
    exponents = np.frexp(sizes)[1]
    return [np.flatnonzero(exponents == exponent) for exponent in np.unique(exponents)]


def _pierces(segments: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(K,) bool, whether segment k of (K, 2, 3) passes through triangle k of (K, 3, 3), its boundary included."""
    start, end = segments[:, 0], segments[:, 1]
    a, b, c = (triangles[:, corner] for corner in range(3))
    apart = _volume(a, b, c, start) * _volume(a, b, c, end) < 0
    around = np.array([_volume(start, end, a, b), _volume(start, end, b, c), _volume(start, end, c, a)])
    return apart & ((around >= 0).all(axis=0) | (around <= 0).all(axis=0))


def _volume(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """(K,) six times the signed volume of each tetrahedron."""
    return row_dot(np.cross(b - a, c - a), d - a)
