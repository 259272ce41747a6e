"""Where a surface ends: its boundary edges, the points on them, and barycentric coordinates."""

from __future__ import annotations

import numpy as np

from ..types import TriangleMesh
from .half_edges import HalfEdges
from .mesh import unique_points
from .vectors import TINY, row_dot

ON_EDGE = 1e-6  # barycentric coordinate below which a point lies on the opposite edge; rounding stays far below


def boundary_edges(mesh: TriangleMesh) -> np.ndarray:
    """(B, 2) directed edges a -> b of triangles without a triangle that has b -> a; repeated for each one that lacks its opposite."""
    table = HalfEdges.of(mesh)
    surplus = np.bincount(table.edge, np.where(table.start <= table.end, 1, -1), len(table.edges)).astype(np.int64)
    directed = np.where(surplus[:, None] < 0, table.edges[:, ::-1], table.edges)
    return np.repeat(directed, np.abs(surplus), axis=0)


def barycentric(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(N, 3) barycentric coordinates of (N, 3) points in triangles with (N, 3, 3) corners, clipped to the triangle."""
    a, b, c = corners.transpose(1, 0, 2)
    u, v, p = b - a, c - a, points - a
    uu, uv, vv = (row_dot(x, y) for x, y in ((u, u), (u, v), (v, v)))
    pu, pv = row_dot(p, u), row_dot(p, v)
    area = np.maximum(uu * vv - uv * uv, TINY)
    second, third = (vv * pu - uv * pv) / area, (uu * pv - uv * pu) / area
    weights = np.clip(np.stack([1.0 - second - third, second, third], axis=1), 0.0, 1.0)
    return weights / weights.sum(axis=1, keepdims=True)


def border_edges(mesh: TriangleMesh) -> np.ndarray:
    """(T, 3) bool, whether the edge opposite to each corner has one triangle only. Coincident vertices count as one."""
    table = HalfEdges(unique_points(mesh.vertices)[1][mesh.triangles], len(mesh.vertices))
    return (table.face_counts == 1)[table.edge].reshape(-1, 3)[:, [1, 2, 0]]


def on_border(mesh: TriangleMesh, border: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N,) bool, whether each of (N, 3) points, on the (N,) triangles, lies on a boundary edge.  border : from `border_edges`."""
    result = border[triangles].any(axis=1)
    near = np.flatnonzero(result)
    weights = barycentric(points[near], mesh.vertices[mesh.triangles[triangles[near]]])
    result[near] = (border[triangles[near]] & (weights < ON_EDGE)).any(axis=1)
    return result
