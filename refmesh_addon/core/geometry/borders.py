"""Where a surface ends: its border edges, the points on them, and barycentric weights."""

from __future__ import annotations

import numpy as np

from ..types import TriangleMesh
from .mesh import TINY, distinct

ON_EDGE = 1e-6  # barycentric weight below which a point counts as lying on the opposite edge; rounding stays far below


def boundary_edges(mesh: TriangleMesh) -> np.ndarray:
    """(B, 2) directed edges a -> b of triangles that no triangle runs along from b to a; repeated if need be."""
    directed = mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    count = len(mesh.vertices)
    low, high = directed.min(axis=1), directed.max(axis=1)
    edge, inverse = np.unique(low * count + high, return_inverse=True)
    surplus = np.bincount(inverse, np.where(directed[:, 0] == low, 1, -1), len(edge)).astype(np.int64)
    pairs = np.stack([edge // count, edge % count], axis=1)
    pairs[surplus < 0] = pairs[surplus < 0][:, ::-1]
    return np.repeat(pairs, np.abs(surplus), axis=0)


def barycentric(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(N, 3) weights, none negative and summing to 1, of (N, 3) points in their (N, 3, 3) triangles, corner by row."""
    a, b, c = corners.transpose(1, 0, 2)
    u, v, p = b - a, c - a, points - a
    uu, uv, vv = (np.einsum("ij,ij->i", x, y) for x, y in ((u, u), (u, v), (v, v)))
    pu, pv = np.einsum("ij,ij->i", p, u), np.einsum("ij,ij->i", p, v)
    area = np.maximum(uu * vv - uv * uv, TINY)
    second, third = (vv * pu - uv * pv) / area, (uu * pv - uv * pu) / area
    weights = np.clip(np.stack([1.0 - second - third, second, third], axis=1), 0.0, 1.0)
    return weights / weights.sum(axis=1, keepdims=True)


def border_edges(mesh: TriangleMesh) -> np.ndarray:
    """(T, 3) bool: whether the edge opposite to each corner belongs to one triangle only. Coinciding vertices count as one."""
    corners = distinct(mesh.vertices)[1][mesh.triangles]
    ends = np.sort(np.stack([corners[:, [1, 2, 0]], corners[:, [2, 0, 1]]], axis=2), axis=2)
    _, inverse, counts = np.unique(ends[..., 0] * len(mesh.vertices) + ends[..., 1], return_inverse=True, return_counts=True)
    return (counts[inverse.reshape(-1)] == 1).reshape(-1, 3)


def on_border(mesh: TriangleMesh, border: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N,) bool: whether each of (N, 3) points of the (N,) triangles lies on a border edge of `border_edges`."""
    result = border[triangles].any(axis=1)
    near = np.flatnonzero(result)
    shares = barycentric(points[near], mesh.vertices[mesh.triangles[triangles[near]]])
    result[near] = (border[triangles[near]] & (shares < ON_EDGE)).any(axis=1)
    return result
