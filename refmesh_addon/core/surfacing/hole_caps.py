"""Smooth caps for the holes of a capture: Liepa, "Filling holes in meshes", SGP 2003, in his three steps.

A hole is triangulated with the least area (Barequet & Sharir 1995), refined to the edge length of its rim, and faired. A hole within
a smooth surface gets a patch that continues it (thin plate). Where the cap meets the surface at an angle, as the sole of a shoe
does, a continuation would bulge far beyond the rim, and the cap is a membrane, which stays within the hull of the rim.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..geometry.borders import boundary_edges
from ..geometry.cotangent import cotangent_weights
from ..geometry.factor import factored
from ..geometry.graph import connected_components
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import triangle_areas, triangle_normals, vertex_areas
from ..geometry.vectors import TINY, row_dot
from ..types import FrozenArrays, TriangleMesh
from .edge_flips import flipped
from .minimal_triangulation import minimal_triangulation

MOST_CORNERS = 600  # of a rim that is triangulated with the least area, in time and memory that grow with the cube and square of it
REFINEMENTS, FLIPS = 12, 4  # rounds that insert points, and passes of edge flips after each; a sole takes five
LARGEST = 1.5  # area of a triangle that is divided, in equilateral triangles of the rim's edge length
MEMBRANE_STEPS = 4  # of mean curvature flow with implicit steps of infinite length; two are enough for a flat sole
SMOOTH = 0.7  # least cosine, in the mean over a rim, between the membrane and the surface for the surface to be continued
FARTHEST = 0.25  # of a continuation from the membrane, as a share of the square root of its area; beyond that the membrane is the cap


@dataclass(frozen=True)
class CappedMesh(FrozenArrays):
    """A capture with its holes capped.

    mesh : closed; the vertices and triangles of the capture come first, in their order.
    holes : (T,) int32, which hole a triangle caps; -1 for triangles of the capture.
    """

    mesh: TriangleMesh
    holes: np.ndarray


def without_holes(mesh: TriangleMesh) -> CappedMesh:
    """A closed mesh, all of it captured."""
    return CappedMesh(mesh, np.full(len(mesh.triangles), -1, dtype=np.int32))


def smoothly_capped(mesh: TriangleMesh) -> CappedMesh:
    """The mesh with a smooth cap on each hole, see above.

    Rims that touch or cross themselves, and those of more than MOST_CORNERS edges, get a fan around their middle. A mesh without
    holes stays as it is.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> round(float(triangle_areas(smoothly_capped(square).mesh).sum()), 6)
    2.0
    """
    open_edges = boundary_edges(mesh)
    if not len(open_edges):
        return without_holes(mesh)
    _, component = connected_components(open_edges, len(mesh.vertices))
    rims = [open_edges[component[open_edges[:, 0]] == label] for label in np.unique(component[open_edges[:, 0]])]
    vertices, triangles = [mesh.vertices], [mesh.triangles]
    holes, count = [np.full(len(mesh.triangles), -1, dtype=np.int32)], len(mesh.vertices)
    for number, rim in enumerate(rims):
        added, cap = _cap(mesh, rim, count) or _fan(mesh, rim, count)
        vertices.append(added)
        triangles.append(cap)
        holes.append(np.full(len(cap), number, dtype=np.int32))
        count += len(added)
    return CappedMesh(TriangleMesh(np.concatenate(vertices), np.concatenate(triangles)), np.concatenate(holes))


def _loop(rim: np.ndarray) -> np.ndarray | None:
    """(N,) vertices of a rim against the direction of its (N, 2) edges, as its cap has them; None where it is not a simple loop."""
    following = dict(rim.tolist())
    if len(following) < len(rim) or len(set(following.values())) < len(rim) or not 3 <= len(rim) <= MOST_CORNERS:
        return None
    loop = [int(rim[0, 0])]
    while (vertex := following[loop[-1]]) != loop[0]:  # ends: each vertex follows one other, so that the first comes back
        loop.append(vertex)
    return np.array(loop[::-1])


def _fan(mesh: TriangleMesh, rim: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles between the edges of a rim and a new vertex in the middle.  count : vertices that come before."""
    start, end = mesh.vertices[rim].transpose(1, 0, 2)
    length = np.maximum(np.linalg.norm(end - start, axis=1), TINY)
    middle = length @ (start + end) / (2 * length.sum())
    return middle[None], np.column_stack([rim[:, ::-1], np.full(len(rim), count)])


def _cap(mesh: TriangleMesh, rim: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray] | None:
    """New vertices (N, 3) of the smooth cap of a rim, and its triangles; None where there is none.  count : vertices that come before."""
    loop = _loop(rim)
    triangles = None if loop is None else minimal_triangulation(mesh.vertices[loop], _joined(mesh, loop))
    if loop is None or triangles is None:
        return None
    corners = mesh.vertices[loop]
    length = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).mean()
    membrane = _membrane(_refined(TriangleMesh(corners, triangles), float(length)), len(loop))
    fair = _continued(mesh, loop, membrane)
    numbers = np.concatenate([loop, count + np.arange(len(fair.vertices) - len(loop))])
    return fair.vertices[len(loop) :], numbers[fair.triangles]


def _joined(mesh: TriangleMesh, loop: np.ndarray) -> np.ndarray:
    """(N, N) bool, which vertices of a loop an edge of the mesh joins: as an edge of the cap it would have four triangles."""
    edges = HalfEdges.of(mesh).edges
    place = np.full(len(mesh.vertices), -1)
    place[loop] = np.arange(len(loop))
    first, second = place[edges[(place[edges] >= 0).all(axis=1)]].T
    result = np.zeros((len(loop), len(loop)), dtype=bool)
    result[first, second] = result[second, first] = True
    return result


def _refined(patch: TriangleMesh, length: float) -> TriangleMesh:
    """The patch with vertices added inside until its triangles are about as large as edges of this length make them."""
    largest = LARGEST * np.sqrt(3) / 4 * length**2
    for _ in range(REFINEMENTS):
        patch = _with_flips(patch)
        large = np.flatnonzero(triangle_areas(patch) > largest)
        if not len(large):
            break
        a, b, c = patch.triangles[large].T
        middle = len(patch.vertices) + np.arange(len(large))
        vertices = np.vstack([patch.vertices, patch.vertices[patch.triangles[large]].mean(axis=1)])
        parts = [np.column_stack(corners) for corners in ((a, b, middle), (b, c, middle), (c, a, middle))]
        patch = TriangleMesh(vertices, np.concatenate([np.delete(patch.triangles, large, axis=0), *parts]))
    return patch


def _with_flips(patch: TriangleMesh) -> TriangleMesh:
    free = np.zeros(len(patch.vertices), dtype=bool)
    for _ in range(FLIPS):
        patch = flipped(patch, free)
    return patch


def _membrane(patch: TriangleMesh, rim: int) -> TriangleMesh:
    """The patch with its inner vertices where its area is least.  rim : how many vertices, the first ones, stay."""
    for _ in range(MEMBRANE_STEPS):
        if len(patch.vertices) > rim:
            laplacian = sparse.csgraph.laplacian(cotangent_weights(patch)).tocsr()[rim:]
            inner = factored(laplacian[:, rim:]).solve(-(laplacian[:, :rim] @ patch.vertices[:rim]))
            patch = patch.moved(np.vstack([patch.vertices[:rim], inner]))
        patch = _with_flips(patch)
    return patch


def _continued(mesh: TriangleMesh, loop: np.ndarray, membrane: TriangleMesh) -> TriangleMesh:
    """The patch that continues the surface around it, if it is smooth there, with the least bending; the membrane otherwise."""
    rim = len(loop)
    around = _around(mesh, loop)
    if len(membrane.vertices) == rim or _agreement(around, membrane, rim) < SMOOTH:
        return membrane
    count = len(around.vertices)
    numbers = np.concatenate([np.arange(rim), count + np.arange(len(membrane.vertices) - rim)])
    both = TriangleMesh(
        np.vstack([around.vertices, membrane.vertices[rim:]]), np.concatenate([around.triangles, numbers[membrane.triangles]])
    )
    rows = np.concatenate([np.arange(rim), np.arange(count, len(both.vertices))])  # around these, the surface is complete
    laplacian = sparse.csgraph.laplacian(cotangent_weights(both)).tocsr()[rows]
    bending = sparse.diags(1 / np.sqrt(np.maximum(vertex_areas(both)[rows], TINY))) @ laplacian
    inner, fixed = bending[:, count:], bending[:, :count] @ around.vertices
    moved = factored(inner.T @ inner).solve(-(inner.T @ fixed))
    farthest = np.linalg.norm(moved - membrane.vertices[rim:], axis=1).max()
    near = farthest < FARTHEST * np.sqrt(triangle_areas(membrane).sum())
    return membrane.moved(np.vstack([membrane.vertices[:rim], moved])) if near else membrane


def _around(mesh: TriangleMesh, loop: np.ndarray) -> TriangleMesh:
    """The triangles at the vertices of a loop; its vertices come first, in order."""
    numbers = np.full(len(mesh.vertices), -1, dtype=np.int64)
    numbers[loop] = np.arange(len(loop))
    triangles = mesh.triangles[(numbers[mesh.triangles] >= 0).any(axis=1)]
    others = np.setdiff1d(triangles, loop)
    numbers[others] = len(loop) + np.arange(len(others))
    return TriangleMesh(mesh.vertices[np.concatenate([loop, others])], numbers[triangles])


def _agreement(around: TriangleMesh, patch: TriangleMesh, rim: int) -> float:
    """Mean cosine between the normals of the two triangles at each edge of a rim, which has the first `rim` vertices of both."""
    sides = []
    for mesh in (around, patch):
        table = HalfEdges.of(mesh)
        following = (table.start + 1) % rim == table.end if mesh is patch else (table.end + 1) % rim == table.start
        at_rim = np.flatnonzero(following & (table.start < rim) & (table.end < rim))
        normals = np.zeros((rim, 3))
        normals[table.start[at_rim] if mesh is patch else table.end[at_rim]] = triangle_normals(mesh)[at_rim // 3]
        sides.append(normals)
    return float(row_dot(*sides).mean())
