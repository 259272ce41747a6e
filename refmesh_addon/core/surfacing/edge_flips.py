"""Better shaped triangles on the same surface: edges flipped, vertices moved along the surface and put back onto it.

The flips and the tangential smoothing of Botsch & Kobbelt, "A remeshing approach to multiresolution modeling", SGP 2004, here
all those at a time that do not touch each other.
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

ROUNDS = 2  # of flips and smoothing; more of them even out what the collapses had fitted to the shape
FLIPS = 3  # passes of flips in a round
FLATNESS = 0.8  # least cosine between the two triangles of an edge that is flipped, and between theirs before and after
LEAST_GAIN = 0.02  # of the worse of the two qualities
STEP = 0.5  # share of the way to the middle of the neighbors


def regularized(mesh: TriangleMesh, surface: SurfaceIndex, frozen: np.ndarray) -> TriangleMesh:
    """The closed mesh with as many vertices and triangles, of better shape, its moved vertices on `surface`.

    frozen : (V,) True for vertices that stay, with the edges at them.
    """
    for _ in range(ROUNDS):
        for _ in range(FLIPS):
            mesh = _flipped(mesh, frozen)
        mesh = _smoothed(mesh, surface, frozen)
    return mesh


def quality(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(T,) of each triangle, as `triangle_shapes` has it."""
    return triangle_shapes(vertices[triangles])[1]


def _flipped(mesh: TriangleMesh, frozen: np.ndarray) -> TriangleMesh:
    """The mesh with the edges flipped that gain most among those of their two triangles."""
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
    for found in (first, second):
        turned = triangle_normals(TriangleMesh(vertices, found))
        flat &= (np.einsum("kij,ij->ki", normals, turned) > FLATNESS).all(axis=0)
    crossing = np.sort(apex, axis=1) @ [count, 1]
    known = np.sort(np.column_stack([start, end]), axis=1) @ [count, 1]
    gain[~flat | np.isin(crossing, known) | frozen[start] | frozen[end] | frozen[apex].any(axis=1)] = 0
    chosen = _best_alone(gain, pairs, crossing, len(triangles))
    triangles[pairs[0, chosen]], triangles[pairs[1, chosen]] = first[chosen], second[chosen]
    return TriangleMesh(vertices, triangles)


def _best_alone(gain: np.ndarray, pairs: np.ndarray, crossing: np.ndarray, count: int) -> np.ndarray:
    """Indices of edges that gain more than all others of their two triangles; no two of them would make the same edge."""
    rank = np.empty(len(gain), dtype=np.int64)
    rank[np.argsort(gain, kind="stable")] = np.arange(len(gain))
    best = np.full(count, -1)
    for owners in pairs:
        np.maximum.at(best, owners, rank)
    chosen = np.flatnonzero((best[pairs] == rank).all(axis=0) & (gain > LEAST_GAIN))
    return chosen[np.unique(crossing[chosen], return_index=True)[1]]


def _smoothed(mesh: TriangleMesh, surface: SurfaceIndex, frozen: np.ndarray) -> TriangleMesh:
    """Each vertex part of the way to the middle of its neighbors, along the surface and back onto it; along a crease only on one."""
    step = neighbor_averages(triangle_adjacency(mesh), mesh.vertices) - mesh.vertices
    moved = surface.query(mesh.vertices + STEP * tangential_part(mesh, step)).points
    return _without_damage(mesh, np.where(frozen[:, None], mesh.vertices, moved))


def _without_damage(mesh: TriangleMesh, moved: np.ndarray) -> TriangleMesh:
    """The mesh on new positions; vertices of triangles that would turn over stay where they are."""
    normals = triangle_normals(mesh)
    for _ in range(3):
        turned = row_dot(normals, triangle_normals(mesh.moved(moved))) < FLATNESS / 2
        if not turned.any():
            return mesh.moved(moved)
        moved = moved.copy()
        kept = mesh.triangles[turned]
        moved[kept] = mesh.vertices[kept]
    return mesh.moved(moved)
