"""Regularization by edge flips and tangential smoothing: better triangles on the same surface.

Botsch & Kobbelt, "A remeshing approach to multiresolution modeling", SGP 2004; here all flips at a time that are independent of each
other.
"""

from __future__ import annotations

import numpy as np

from ..geometry.closest_point import SurfaceIndex
from ..geometry.cotangent import neighbor_averages, triangle_adjacency
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import triangle_normals, triangle_shapes
from ..geometry.tangents import tangential_part
from ..geometry.vectors import row_dot
from ..types import TriangleMesh

ROUNDS = 2  # of flips and smoothing; more of them undo what the collapses had adapted to the shape
FLIPS = 3  # passes of flips in a round
FLATNESS = 0.8  # least cosine between the two triangles of an edge that is flipped, and between theirs before and after
LEAST_GAIN = 0.02  # by which a flip must raise the lower quality of its two triangles
STEP = 0.5  # share of the way to the mean of the neighbors
LEAST_COSINE = FLATNESS / 2  # between the normals of a triangle before and after smoothing
MOST_RESETS = 3  # rounds that put vertices back, after which their neighbors' triangles may turn over in turn


def regularized(mesh: TriangleMesh, surface: SurfaceIndex, frozen: np.ndarray) -> TriangleMesh:
    """A mesh with as many vertices and triangles of better shape, its moved vertices on `surface`.

    mesh : edges with other than two triangles are not flipped.  frozen : (V,) bool, vertices that stay, with the edges at them.
    """
    for _ in range(ROUNDS):
        for _ in range(FLIPS):
            mesh = flipped(mesh, frozen)
        mesh = _smoothed(mesh, surface, frozen)
    return mesh


def quality(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(T,) quality of each triangle, as from `triangle_shapes`."""
    return triangle_shapes(vertices[triangles])[1]


def flipped(mesh: TriangleMesh, frozen: np.ndarray) -> TriangleMesh:
    """The mesh with those edges flipped that gain more than the other edges of their two triangles.

    frozen : (V,) bool, vertices at which no edge is flipped.
    """
    vertices, triangles, count = mesh.vertices, mesh.triangles.astype(np.int64), len(mesh.vertices)
    table = HalfEdges(triangles, count)
    half_edges = table.pairs
    start, end, apex, pairs = table.start[half_edges[:, 0]], table.end[half_edges[:, 0]], table.previous[half_edges], half_edges.T // 3
    first = np.column_stack([start, apex[:, 1], apex[:, 0]])  # the triangles after the flip
    second = np.column_stack([apex[:, 1], end, apex[:, 0]])
    before = np.minimum(*quality(vertices, triangles)[pairs])
    gain = np.minimum(quality(vertices, first), quality(vertices, second)) - before
    normals = triangle_normals(mesh)[pairs]
    flat = row_dot(*normals) > FLATNESS
    for after in (first, second):
        flat &= (np.einsum("kij,ij->ki", normals, triangle_normals(TriangleMesh(vertices, after))) > FLATNESS).all(axis=0)
    new_edge = np.sort(apex, axis=1) @ [count, 1]
    present = table.edges @ np.array([count, 1])
    gain[~flat | np.isin(new_edge, present) | frozen[start] | frozen[end] | frozen[apex].any(axis=1)] = 0
    chosen = _independent(gain, pairs, new_edge, len(triangles))
    triangles[pairs[0, chosen]], triangles[pairs[1, chosen]] = first[chosen], second[chosen]
    return TriangleMesh(vertices, triangles)


def _independent(gain: np.ndarray, pairs: np.ndarray, new_edge: np.ndarray, count: int) -> np.ndarray:
    """Indices of edges that gain more than all others of their two triangles, no two of which would become the same edge."""
    rank = np.empty(len(gain), dtype=np.int64)
    rank[np.argsort(gain, kind="stable")] = np.arange(len(gain))
    best = np.full(count, -1)
    for owners in pairs:
        np.maximum.at(best, owners, rank)
    chosen = np.flatnonzero((best[pairs] == rank).all(axis=0) & (gain > LEAST_GAIN))
    return chosen[np.unique(new_edge[chosen], return_index=True)[1]]


def _smoothed(mesh: TriangleMesh, surface: SurfaceIndex, frozen: np.ndarray) -> TriangleMesh:
    """The mesh with each vertex moved tangentially part of the way to the mean of its neighbors, and projected back onto the surface."""
    step = neighbor_averages(triangle_adjacency(mesh), mesh.vertices) - mesh.vertices
    moved = surface.query(mesh.vertices + STEP * tangential_part(mesh, step)).points
    return _without_flips(mesh, np.where(frozen[:, None], mesh.vertices, moved))


def _without_flips(mesh: TriangleMesh, moved: np.ndarray) -> TriangleMesh:
    """The mesh with moved vertices, except those of triangles that would turn over."""
    normals = triangle_normals(mesh)
    for _ in range(MOST_RESETS):
        flipped = row_dot(normals, triangle_normals(mesh.moved(moved))) < LEAST_COSINE
        if not flipped.any():
            return mesh.moved(moved)
        moved = moved.copy()
        kept = mesh.triangles[flipped]
        moved[kept] = mesh.vertices[kept]
    return mesh.moved(moved)
