"""Which points of a deformed reference and of a source surface belong together: closest points that pass every check."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from .closest_point import SurfaceIndex
from .geometry import TINY, merged, normalized, triangle_normals, vertex_normals
from .types import TriangleMesh, _FrozenArrays

# compatible(vertex_ids, triangle_ids) -> bool for each pair: may this reference vertex lie on this source triangle?
Compatible = Callable[[np.ndarray, np.ndarray], np.ndarray]

TOUCHING = 1e-6  # share of the greatest distance below which an offset has no direction worth following
ON_EDGE = 1e-6  # barycentric weight below which a point counts as lying on the opposite edge; rounding stays far below


@dataclass(frozen=True)
class Limits:
    """distance : the farthest partner, scene units.  cosine : least agreement of the two normals.  stride : every n-th point is asked."""

    distance: float
    cosine: float
    stride: int = 1


@dataclass(frozen=True)
class Pairs(_FrozenArrays):
    """K points of the reference, each with its place on the source.

    corners : (K, 3) reference vertices around the point.  shares : (K, 3) their barycentric weights.
    targets : (K, 3) scene units.  normals : (K, 3) unit directions in which the two surfaces lie apart there.
    distances : (K,) from the point to its target, scene units.
    """

    corners: np.ndarray
    shares: np.ndarray
    targets: np.ndarray
    normals: np.ndarray
    distances: np.ndarray

    def rows(self, count: int) -> sparse.csr_matrix:
        """(K, count) matrix that turns vertex positions into the K points."""
        index = np.repeat(np.arange(len(self.corners)), 3)
        used = self.shares.ravel() != 0
        return sparse.csr_matrix((self.shares.ravel()[used], (index[used], self.corners.ravel()[used])), shape=(len(self.corners), count))


class Correspondence:
    """Partners between one source surface and any deformation of one reference.

    source : the frame's surface; seams (coinciding vertices) are seen as closed.
    reference : its triangles count, not its positions.
    compatible : pairs it refuses are never joined; None allows all.
    """

    def __init__(self, source: SurfaceIndex, reference: TriangleMesh, compatible: Compatible | None = None):
        self._source, self._reference, self._compatible = source, reference, compatible
        self._normals = triangle_normals(source.mesh)
        self._source_border = border_edges(source.mesh)
        self._reference_border = border_edges(reference)
        whole, kept = merged(source.mesh)
        order = np.argsort(kept)  # as the source has them: what a stride picks must not depend on coordinates
        self._samples, self._sample_normals = whole.vertices[order], vertex_normals(whole)[order]
        self._sample_triangles = _any_triangle(source.mesh)[kept[order]]

    def from_reference(self, mesh: TriangleMesh, limits: Limits) -> Pairs:
        """Each vertex of the deformed reference and the closest point of the source.

        Vertices whose closest point lies on the border of a hole have no partner: the hole is where the source has no surface.
        """
        found = self._source.query(mesh.vertices[:: limits.stride], limits.distance)
        near = np.flatnonzero(found.triangles >= 0)
        vertex, triangle = near * limits.stride, found.triangles[near]
        good = _agreement(vertex_normals(mesh)[vertex], self._normals[triangle]) > limits.cosine
        good &= ~on_border(self._source.mesh, self._source_border, triangle, found.points[near])
        good = self._allowed(good, vertex, triangle)
        shares = np.tile([1.0, 0.0, 0.0], (np.count_nonzero(good), 1))
        corners, found_at = np.repeat(vertex[good, None], 3, axis=1), near[good]
        apart = _apart(mesh.vertices[vertex[good]] - found.points[found_at], self._normals[triangle[good]], limits)
        return Pairs(corners, shares, found.points[found_at], apart, found.distances[found_at])

    def from_source(self, mesh: TriangleMesh, limits: Limits) -> Pairs:
        """Each vertex of the source and the closest point of the deformed reference: reaches what the reference has missed."""
        found = SurfaceIndex(mesh).query(self._samples[:: limits.stride], limits.distance)
        near = np.flatnonzero(found.triangles >= 0)
        sample, triangle = near * limits.stride, found.triangles[near]
        normals = triangle_normals(mesh)[triangle]
        good = _agreement(self._sample_normals[sample], normals) > limits.cosine
        good &= ~on_border(mesh, self._reference_border, triangle, found.points[near])
        corners = mesh.triangles[triangle]
        shares = barycentric(found.points[near], mesh.vertices[corners])
        nearest = np.take_along_axis(corners, shares.argmax(axis=1)[:, None], axis=1)[:, 0]
        good = self._allowed(good, nearest, self._sample_triangles[sample])
        targets, found_at = self._samples[sample[good]], near[good]
        apart = _apart(found.points[found_at] - targets, normals[good], limits)
        return Pairs(corners[good], shares[good], targets, apart, found.distances[found_at])

    def _allowed(self, good: np.ndarray, vertex: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        if self._compatible is not None:
            good[good] = self._compatible(vertex[good], triangle[good])
        return good


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
    _, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    corners = place.reshape(-1)[mesh.triangles].astype(np.int64)
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


def _apart(offsets: np.ndarray, normals: np.ndarray, limits: Limits) -> np.ndarray:
    """Unit directions of (K, 3) offsets to closest points; the triangle's normal where a point lies on the surface.

    Inside a triangle both are the same line. On an edge, rounding decides which triangle was found, but not the direction.
    """
    touching = np.linalg.norm(offsets, axis=1) <= TOUCHING * limits.distance
    return np.where(touching[:, None], normals, normalized(offsets))


def _agreement(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)


def _any_triangle(mesh: TriangleMesh) -> np.ndarray:
    """(V,) index of one triangle at each vertex, the last; 0 for a vertex without triangles."""
    result = np.zeros(len(mesh.vertices), dtype=np.int64)
    result[mesh.triangles.ravel()] = np.repeat(np.arange(len(mesh.triangles)), 3)
    return result
