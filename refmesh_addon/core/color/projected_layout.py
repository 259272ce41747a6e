"""A plain layout without xatlas: charts of triangles that face one of a few directions, seen along it, packed in rows.

As Blender's Smart UV Project does: little stretch, many seams, and where a chart lies over itself its triangles share texels.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from ..errors import RefMeshError
from ..geometry.graph import connected_components
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import triangle_normals
from ..geometry.vectors import normalized
from ..types import TriangleMesh
from .layout import Layout

SPACING = 4 / 1024  # between charts, share of the texture's side
MOST_ATTEMPTS = 400  # each with charts 5 % smaller: a billion times smaller at the end


def projected_layout(mesh: TriangleMesh) -> Layout:
    """A layout of any mesh with area, in milliseconds; no chart is mirrored."""
    directions = normalized(np.array([corner for corner in product((-1.0, 0.0, 1.0), repeat=3) if any(corner)]))
    facing = (triangle_normals(mesh) @ directions.T).argmax(axis=1)
    chart = _connected(mesh, facing)
    first, corners = np.unique(mesh.triangles + chart[:, None].astype(np.int64) * len(mesh.vertices), return_inverse=True)
    corners = corners.reshape(-1, 3)
    owner = np.empty(len(first), np.int64)
    owner[corners] = chart[:, None]
    direction = np.empty(len(first), np.int64)
    direction[corners] = facing[:, None]
    places = _seen_along(mesh.vertices[first % len(mesh.vertices)], directions[direction])
    return Layout(_packed(places, owner), corners.astype(np.int32))


def _connected(mesh: TriangleMesh, facing: np.ndarray) -> np.ndarray:
    """(T,) chart of each triangle: neighbors that face the same direction share one."""
    one, other = (HalfEdges.of(mesh).pairs // 3).T
    same = facing[one] == facing[other]
    return connected_components(np.column_stack([one, other])[same], len(facing))[1]


def _seen_along(points: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(N, 2) points as seen against their (N, 3) directions: not mirrored."""
    least = np.eye(3)[np.abs(directions).argmin(axis=1)]
    right = normalized(np.cross(least, directions))
    up = np.cross(directions, right)
    return np.stack([np.einsum("ni,ni->n", points, axis) for axis in (right, up)], axis=1)


def _packed(places: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """Places of all charts, highest first, in rows of a square of side one."""
    count = owner.max() + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, owner, places)
    np.maximum.at(high, owner, places)
    sizes, order = high - low, np.argsort(-(high - low)[:, 1], kind="stable")
    scale = 0.9 / np.sqrt(np.prod(sizes, axis=1).sum())
    spacing = min(SPACING, 0.5 / np.ceil(np.sqrt(count)))  # rows of charts without extent then fill half of the square at most
    corners = None
    for _ in range(MOST_ATTEMPTS):
        corners = _rows(sizes[order] * scale + spacing)
        if corners is not None:
            break
        scale *= 0.95
    if corners is None:
        raise RefMeshError(f"the {count} charts of a texture layout cannot be packed; the mesh has triangles of very different sizes")
    start = np.empty_like(low)
    start[order] = corners + spacing / 2
    return (places - low[owner]) * scale + start[owner]


def _rows(sizes: np.ndarray) -> np.ndarray | None:
    """(C, 2) lower left corners of rectangles laid in rows, None where they do not fit into the unit square."""
    corners, x, y, height = np.empty_like(sizes), 0.0, 0.0, 0.0
    for index, (width, tall) in enumerate(sizes):
        if x and x + width > 1.0:
            x, y, height = 0.0, y + height, 0.0
        corners[index] = x, y
        x, height = x + width, max(height, tall)
    return corners if (corners + sizes).max() <= 1.0 else None
