"""Exact closest points on a triangle mesh, vectorised over the queries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .types import TriangleMesh, _FrozenArrays

NEAR_PROXIES = 8  # proxies looked at in the first full round; enough for most points near the surface
MAX_SPLITS = 8  # halvings of one triangle's radius; beyond that its proxies stay large and searches just slow down


@dataclass(frozen=True)
class ClosestPoints(_FrozenArrays):
    """points : (N, 3) on the surface; triangles : (N,) int64; distances : (N,) scene units.

    Queries farther than `max_distance` have distance inf, triangle -1 and their own position.
    """

    points: np.ndarray
    triangles: np.ndarray
    distances: np.ndarray


class SurfaceIndex:
    """Built once from a mesh, asked often.

    Triangles are found through proxies: points that each stand for a piece of one triangle within `radius`. Large
    triangles are split into several proxies, so that one large triangle does not widen every search.
    """

    def __init__(self, mesh: TriangleMesh):
        if not len(mesh.triangles):
            raise ValueError("mesh has no triangles to measure to")
        self.mesh = mesh
        self._corners = mesh.vertices[mesh.triangles]
        centers, self._radii, self._owners = _proxies(self._corners)
        self._largest = float(self._radii.max())
        self._tree = cKDTree(centers)

    def query(self, points: np.ndarray, max_distance: float = np.inf) -> ClosestPoints:
        """Closest surface point of each of (N, 3) points."""
        points = np.asarray(points, dtype=np.float64)
        best = np.full(len(points), float(max_distance))
        owner = np.full(len(points), -1)
        closest = points.copy()
        # The nearest proxy first: its exact distance rules out almost all others.
        active, count = np.arange(len(points)), 1
        while len(active):
            distance, near = self._tree.query(points[active], k=np.arange(1, count + 1), workers=-1)
            # A piece can only win if its proxy is nearer than the best so far plus the proxy's own radius.
            found = np.isfinite(distance)
            reach = np.where(found, best[active][:, None] + self._radii[np.where(found, near, 0)], 0.0)
            rows, columns = np.nonzero(distance < reach)
            self._improve(points, active[rows], self._owners[near[rows, columns]], best, owner, closest)
            active = active[distance[:, -1] < best[active] + self._largest]
            count = NEAR_PROXIES if count == 1 else 4 * count
        best[owner < 0] = np.inf
        return ClosestPoints(closest, owner, best)

    def _improve(self, points, query, triangle, best, owner, closest):
        on_triangle = closest_on_triangles(points[query], self._corners[triangle])
        length = np.linalg.norm(on_triangle - points[query], axis=1)
        order = np.lexsort((triangle, length, query))  # ties go to the lowest triangle: deterministic
        first = order[np.unique(query[order], return_index=True)[1]]
        better = first[length[first] < best[query[first]]]
        chosen = query[better]
        best[chosen], owner[chosen], closest[chosen] = length[better], triangle[better], on_triangle[better]


def _proxies(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points that stand for pieces of (T, 3, 3) triangles: positions (N, 3), radii (N,), triangle of each (N,).

    Pieces are quartered until their radius is no larger than the median triangle's.
    """
    owners = np.arange(len(corners))
    limit = np.median(_radii(corners))
    done = []
    for _ in range(MAX_SPLITS):
        large = _radii(corners) > limit
        done.append((corners[~large], owners[~large]))
        corners, owners = corners[large], owners[large]
        if not len(owners) or limit == 0:
            break
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = np.concatenate([np.stack(piece, axis=1) for piece in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
        owners = np.tile(owners, 4)
    done.append((corners, owners))
    corners = np.concatenate([piece for piece, _ in done])
    return corners.mean(axis=1), _radii(corners), np.concatenate([owner for _, owner in done])


def _radii(corners: np.ndarray) -> np.ndarray:
    return np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max(axis=1)


def closest_on_triangles(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Closest point of each triangle to its own query.

    points : (N, 3).  corners : (N, 3, 3), corner by row.  Returns (N, 3).

    The projection onto the plane where it falls inside, else the nearest of the three edge projections.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    best = np.empty_like(points)
    best_square = np.full(len(points), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        along = end - start
        share = np.einsum("ij,ij->i", points - start, along) / np.maximum(np.einsum("ij,ij->i", along, along), np.finfo(float).tiny)
        candidate = start + np.clip(share, 0.0, 1.0)[:, None] * along
        square = np.einsum("ij,ij->i", points - candidate, points - candidate)
        nearer = square < best_square
        best[nearer], best_square[nearer] = candidate[nearer], square[nearer]
    ab, ac, ap = b - a, c - a, points - a
    normal = np.cross(ab, ac)
    area = np.einsum("ij,ij->i", normal, normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        v = np.einsum("ij,ij->i", np.cross(ap, ac), normal) / area
        w = np.einsum("ij,ij->i", np.cross(ab, ap), normal) / area
        inside = (area > 0) & (v >= 0) & (w >= 0) & (v + w <= 1)
    best[inside] = (a + v[:, None] * ab + w[:, None] * ac)[inside]
    return best
