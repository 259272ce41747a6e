"""Areas, normals, volumes, components, merging and sampling of triangle meshes."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..types import TriangleMesh
from .graph import connected_components
from .half_edges import HalfEdges
from .vectors import TINY, column_cross, normalized, row_dot


def area_vectors(mesh: TriangleMesh) -> np.ndarray:
    """(T, 3) vector areas: the unit normal of each triangle times its area, scene units squared."""
    axes = np.ascontiguousarray(mesh.vertices.T)  # axis by axis in half the time of np.cross on rows
    a, b, c = (axes.take(corner, axis=1) for corner in mesh.triangles.T)
    u, v = b - a, c - a
    return 0.5 * np.stack([*column_cross(u, v)], axis=1)


def triangles_at(mesh: TriangleMesh, chosen: np.ndarray) -> np.ndarray:
    """(T,) bool, whether a triangle has a corner among the vertices chosen by a (V,) bool mask."""
    a, b, c = (chosen.take(corner) for corner in mesh.triangles.T)
    return a | b | c


def triangle_areas(mesh: TriangleMesh) -> np.ndarray:
    """(T,) area of each triangle, scene units squared."""
    return np.linalg.norm(area_vectors(mesh), axis=1)


def triangle_normals(mesh: TriangleMesh) -> np.ndarray:
    """(T, 3) unit normals; zero for degenerate triangles."""
    return normalized(area_vectors(mesh))


def vertex_normals(mesh: TriangleMesh) -> np.ndarray:
    """(V, 3) area-weighted unit normals; zero where a vertex has no triangle with area."""
    return normalized(vertex_triangle_incidence(mesh) @ area_vectors(mesh))


def vertex_areas(mesh: TriangleMesh) -> np.ndarray:
    """(V,) a third of the area of the triangles around each vertex, scene units squared."""
    return vertex_triangle_incidence(mesh) @ triangle_areas(mesh) / 3.0


def vertex_triangle_incidence(mesh: TriangleMesh) -> sparse.csr_matrix:
    """(V, T) matrix with ones where a vertex is a corner of a triangle: multiplied by it, values of triangles are summed at vertices."""
    count = len(mesh.triangles)
    rows = mesh.triangles.ravel()
    columns = np.repeat(np.arange(count), 3)
    return sparse.csr_matrix((np.ones(3 * count), (rows, columns)), shape=(len(mesh.vertices), count))


def triangle_shapes(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (K, 3) and quality (K,) of triangles given by their (K, 3, 3) corners.

    Quality is 4 sqrt(3) area / sum of squared edge lengths: 1 for an equilateral triangle, 0 for a degenerate one.
    """
    sides = np.roll(corners, -1, axis=1) - corners
    normals = np.cross(sides[:, 0], sides[:, 1])
    return normalized(normals), 2 * np.sqrt(3) * np.linalg.norm(normals, axis=1) / np.maximum((sides**2).sum(axis=(1, 2)), TINY)


def signed_volume(mesh: TriangleMesh) -> float:
    """Enclosed volume, negative for an inside-out mesh; exact for closed meshes, scene units cubed."""
    centered = mesh.vertices - mesh.vertices.mean(axis=0)
    a, b, c = centered[mesh.triangles].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def component_volumes(mesh: TriangleMesh, component: np.ndarray) -> np.ndarray:
    """Enclosed volume of each component, negative for a cavity, scene units cubed.  component : (V,) labels from `vertex_components`."""
    a, b, c = (mesh.vertices - mesh.vertices.mean(axis=0))[mesh.triangles].transpose(1, 0, 2)
    return np.bincount(component[mesh.triangles[:, 0]], row_dot(a, np.cross(b, c)) / 6.0, component.max(initial=-1) + 1)


def mean_edge_length(mesh: TriangleMesh) -> float:
    """Mean over the edges, each counted once, scene units; 0 for a mesh without triangles."""
    edges = HalfEdges.of(mesh).edges
    return float(edge_lengths(mesh.vertices, edges).mean()) if len(edges) else 0.0


def edge_lengths(vertices: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(E,) lengths of (E, 2) edges between (V, 3) vertices, scene units."""
    start, end = edges.T
    return np.linalg.norm(vertices[start] - vertices[end], axis=1)


def vertex_components(mesh: TriangleMesh) -> tuple[int, np.ndarray]:
    """Number of connected components and the (V,) label of each vertex; a vertex without triangles is a component of its own."""
    table = HalfEdges.of(mesh)
    return connected_components(np.column_stack([table.start, table.end]), len(mesh.vertices))


def is_watertight(mesh: TriangleMesh) -> bool:
    """True when each edge has exactly two triangles that run along it in opposite directions."""
    table = HalfEdges.of(mesh)
    one, other = table.pairs.T
    return len(one) > 0 and len(one) == len(table.edges) and np.array_equal(table.start[one], table.end[other])


def submesh(mesh: TriangleMesh, triangles: np.ndarray | slice = slice(None)) -> tuple[TriangleMesh, np.ndarray]:
    """Some triangles and the vertices that they use, in their order.

    triangles : (K,) indices, (T,) bool or a slice; all of them unless stated, which drops unused vertices only.
    Returns the mesh and which vertices of the whole it has, (V',) ascending.
    """
    kept = mesh.triangles[triangles]
    used = np.zeros(len(mesh.vertices), dtype=bool)
    used[kept] = True
    renumbered = np.cumsum(used) - 1
    return TriangleMesh(mesh.vertices[used], renumbered[kept]), np.flatnonzero(used)


def unique_points(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index of the first of all points that coincide exactly, (M,), and which of these M each point coincides with, (N,).

    points : (N, 3). The M points are sorted by x, then y, then z: np.unique with axis=0, in a third of its time.
    """
    order = np.lexsort(points.T[::-1])
    new = np.ones(len(points), dtype=bool)
    new[1:] = (np.diff(points[order], axis=0) != 0).any(axis=1)
    inverse = np.empty(len(points), dtype=np.int64)
    inverse[order] = np.cumsum(new) - 1
    return order[new], inverse


def have_distinct_corners(triangles: np.ndarray) -> np.ndarray:
    """(T,) bool, whether the corners of each of (T, 3) triangles are three different vertices."""
    a, b, c = triangles.T
    return (a != b) & (b != c) & (c != a)


def merged(mesh: TriangleMesh) -> tuple[TriangleMesh, np.ndarray]:
    """The mesh with exactly coincident vertices merged, as along UV seams, and without collapsed triangles and unused vertices.

    Returns the mesh and the (V',) index of an original vertex for each of its vertices.
    """
    first, inverse = unique_points(mesh.vertices)
    triangles = inverse[mesh.triangles]
    result, used = submesh(TriangleMesh(mesh.vertices[first], triangles), have_distinct_corners(triangles))
    return result, first[used]


def sample_surface(mesh: TriangleMesh, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """`count` points distributed uniformly by area: positions (count, 3) and the (count,) triangle of each.

    Raises ValueError for a mesh without area.
    """
    areas = triangle_areas(mesh)
    total = areas.sum()
    if not total > 0:
        raise ValueError("mesh has no area to sample")
    chosen = np.searchsorted(np.cumsum(areas), rng.random(count) * total, side="right").clip(max=len(areas) - 1)
    u, v = rng.random((2, count))
    beyond = u + v > 1
    u[beyond], v[beyond] = 1 - u[beyond], 1 - v[beyond]
    a, b, c = mesh.vertices[mesh.triangles[chosen]].transpose(1, 0, 2)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), chosen
