"""One slide of drift seen by color: vertices moved along the surface toward where the picture at each is that of the anchor frame.

The flow inside the layout says how far the skin has slid below the mesh. Vertices are moved, never pictures: warping a picture
blurs it and leaves the mesh wrong.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.closest_point import SurfaceIndex
from ..geometry.factor import factored
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import triangle_normals, vertex_normals
from ..geometry.vectors import row_dot
from ..types import TriangleMesh
from .layout import Layout
from .optical_flow import Flow
from .texels import Texels

SMOOTHNESS = 4.0  # weight of neighbors that move alike, against one fully trusted vertex
REACH = 0.02  # share of the diagonal: a vertex without surface this near stays where it is
COMPATIBLE = 0.5  # least cosine between the normals of a vertex and its place on the source


def slid(deformed: TriangleMesh, layout: Layout, texels: Texels, flow: Flow, source: SurfaceIndex) -> TriangleMesh:
    """The deformed mesh with its vertices moved along the source by the flow from the anchor's picture to this frame's.

    flow : inside the layout at the size of the texels. Untrusted vertices move as their neighbors do.
    """
    offsets, trust = _vertex_flow(deformed, layout, texels, flow)
    return displaced(deformed, offsets, trust, source)


def displaced(deformed: TriangleMesh, offsets: np.ndarray, trust: np.ndarray, source: SurfaceIndex) -> TriangleMesh:
    """The deformed mesh with its vertices moved along the source.

    offsets : (R, 3) scene units.  trust : (R,) 0 to 1; vertices of little trust move as their neighbors do.
    """
    moved = deformed.moved(deformed.vertices + _spread(deformed, offsets, trust))
    return _onto(moved, deformed, source)


def _vertex_flow(deformed: TriangleMesh, layout: Layout, texels: Texels, flow: Flow) -> tuple[np.ndarray, np.ndarray]:
    """Offset (R, 3) of each vertex, scene units, and how far (R,) it is trusted: the mean over the texels of its triangles."""
    chosen = flow.trusted.ravel()[texels.pixels]
    triangles = texels.triangles[chosen]
    motion = flow.offsets.reshape(-1, 2)[texels.pixels[chosen]]
    tangents = _tangents(deformed, layout, texels.size)[triangles]
    offsets = np.einsum("nij,nj->ni", tangents, motion)
    everything = np.maximum(np.column_stack([1.0 - texels.shares.sum(axis=1), texels.shares]), 0.0)  # beside a chart some are negative
    weights = everything[chosen]
    count, corners = len(deformed.vertices), deformed.triangles[triangles]
    total = np.bincount(corners.ravel(), weights.ravel(), count)
    sums = [np.bincount(corners.ravel(), (weights * offsets[:, axis, None]).ravel(), count) for axis in range(3)]
    seen = np.bincount(deformed.triangles[texels.triangles].ravel(), everything.ravel(), count)
    return np.stack(sums, axis=1) / np.maximum(total, 1e-9)[:, None], total / np.maximum(seen, 1e-9)


def _tangents(mesh: TriangleMesh, layout: Layout, size: int) -> np.ndarray:
    """(S, 3, 2) the way on each triangle, scene units, of one pixel to the right and one down; zero for triangles without area."""
    corners = layout.pixels(size)
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    inverse = np.where(area != 0, 1.0 / np.where(area != 0, area, 1.0), 0.0)[:, None]
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    right = ((b - a) * v[:, 1:] - (c - a) * u[:, 1:]) * inverse
    down = ((c - a) * u[:, :1] - (b - a) * v[:, :1]) * inverse
    return np.stack([right, down], axis=2)


def _spread(mesh: TriangleMesh, offsets: np.ndarray, trust: np.ndarray) -> np.ndarray:
    """Offsets (R, 3) of all vertices: those trusted kept, the others as smooth as can be; least squares with the graph Laplacian."""
    count, (one, other) = len(mesh.vertices), HalfEdges.of(mesh).edges.T
    links = sparse.coo_matrix((np.ones(len(one)), (one, other)), shape=(count, count))
    links = links + links.T
    laplacian = sparse.diags(np.asarray(links.sum(axis=1)).ravel()) - links
    system = sparse.diags(trust + 1e-3) + SMOOTHNESS / 6.0 * laplacian
    return factored(sparse.csc_matrix(system)).solve(trust[:, None] * offsets)


def _onto(moved: TriangleMesh, before: TriangleMesh, source: SurfaceIndex) -> TriangleMesh:
    """Vertices put back at their own height above the source, where it faces as they do."""
    normals = triangle_normals(source.mesh)
    heights = [_height(mesh, source, normals) for mesh in (moved, before)]
    (direction, height, fits), (_, own, own_fits) = heights
    change = np.where(fits & own_fits, own - height, 0.0)
    return moved.moved(moved.vertices + change[:, None] * direction)


def _height(mesh: TriangleMesh, source: SurfaceIndex, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal (R, 3) of the source below each vertex, height (R,) above it, and whether (R,) it is near and faces the same way."""
    closest = source.query(mesh.vertices)
    direction = normals[closest.triangles]
    fits = (row_dot(direction, vertex_normals(mesh)) > COMPATIBLE) & (closest.distances < REACH * source.mesh.diagonal)
    return direction, row_dot(mesh.vertices - closest.points, direction), fits
