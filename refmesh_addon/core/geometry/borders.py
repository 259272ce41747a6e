"""Where a surface ends: its border edges, the points on them, and barycentric weights."""

from __future__ import annotations

import numpy as np

from ..types import TriangleMesh
from .half_edges import HalfEdges
from .mesh import unique_points
from .vectors import TINY, row_dot

ON_EDGE = 1e-6  # barycentric weight below which a point counts as lying on the opposite edge; rounding stays far below


def boundary_edges(mesh: TriangleMesh) -> np.ndarray:
    """(B, 2) directed edges a -> b of triangles that no triangle runs along from b to a; repeated if need be."""
    table = HalfEdges.of(mesh)
    surplus = np.bincount(table.edge, np.where(table.start <= table.end, 1, -1), len(table.edges)).astype(np.int64)
    directed = np.where(surplus[:, None] < 0, table.edges[:, ::-1], table.edges)
    return np.repeat(directed, np.abs(surplus), axis=0)


def barycentric(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(N, 3) weights, none negative and summing to 1, of (N, 3) points in their (N, 3, 3) triangles, corner by row."""
    a, b, c = corners.transpose(1, 0, 2)
    u, v, p = b - a, c - a, points - a
    uu, uv, vv = (row_dot(x, y) for x, y in ((u, u), (u, v), (v, v)))
    pu, pv = row_dot(p, u), row_dot(p, v)
    area = np.maximum(uu * vv - uv * uv, TINY)
    second, third = (vv * pu - uv * pv) / area, (uu * pv - uv * pu) / area
    weights = np.clip(np.stack([1.0 - second - third, second, third], axis=1), 0.0, 1.0)
    return weights / weights.sum(axis=1, keepdims=True)


def border_edges(mesh: TriangleMesh) -> np.ndarray:
    """(T, 3) bool: whether the edge opposite to each corner belongs to one triangle only. Coinciding vertices count as one."""
    table = HalfEdges(unique_points(mesh.vertices)[1][mesh.triangles], len(mesh.vertices))
    return (table.face_counts == 1)[table.edge].reshape(-1, 3)[:, [1, 2, 0]]


def on_border(mesh: TriangleMesh, border: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N,) bool: whether each of (N, 3) points of the (N,) triangles lies on a border edge of `border_edges`."""
    result = border[triangles].any(axis=1)
    near = np.flatnonzero(result)
    shares = barycentric(points[near], mesh.vertices[mesh.triangles[triangles[near]]])
    result[near] = (border[triangles[near]] & (shares < ON_EDGE)).any(axis=1)
    return result
