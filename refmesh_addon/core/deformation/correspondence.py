"""Which points of a deformed reference and of a source surface belong together: closest points that pass every check.

Both surfaces are asked at their vertices and at the centres of their triangles: vertices alone would lie on the other
surface with all triangles between them inside it, where it is convex.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..geometry.borders import barycentric, border_edges, on_border
from ..geometry.closest_point import Allowed, ClosestPoints, SurfaceIndex
from ..geometry.mesh import triangle_normals
from ..geometry.vectors import normalized, row_dot
from ..geometry.winding import Enclosed, enclosed_by
from ..types import FrozenArrays, TriangleMesh
from .surface_samples import SurfaceSampler, SurfaceSamples

# compatible(vertex_ids, triangle_ids) -> bool for each pair: may this reference vertex lie on this source triangle?
Compatible = Callable[[np.ndarray, np.ndarray], np.ndarray]

TOUCHING = 1e-6  # share of the greatest distance below which an offset has no direction worth following
UPRIGHT = 0.7  # least cosine between offset and normal for a partner that is not the closest point: above or below, never beside
BESIDE = -0.1  # least agreement of the two normals for what lies beside: square to each other counts


@dataclass(frozen=True)
class Limits:
    """distance : the farthest partner, scene units.  cosine : least agreement of the two normals.  stride : every n-th point is asked."""

    distance: float
    cosine: float
    stride: int = 1


@dataclass(frozen=True)
class Pairs(FrozenArrays):
    """K points of the reference, each with its place on the source.

    corners : (K, 3) reference vertices around the point.  shares : (K, 3) their barycentric weights.
    targets : (K, 3) scene units.  normals : (K, 3) unit directions in which the two surfaces lie apart there.
    distances : (K,) from the point to its target, scene units.
    weights : (K,) the area that the point stands for, as a share of the mean over all points asked, times how far it is trusted.
    """

    corners: np.ndarray
    shares: np.ndarray
    targets: np.ndarray
    normals: np.ndarray
    distances: np.ndarray
    weights: np.ndarray

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
    enclosed : by the source; found out where it is None.
    """

    def __init__(
        self, source: SurfaceIndex, reference: TriangleMesh, compatible: Compatible | None = None, enclosed: Enclosed | None = None
    ):
        self._source, self._compatible = source, compatible
        self._enclosed = enclosed or enclosed_by(source.mesh)
        self._normals = triangle_normals(source.mesh)
        self._source_border = border_edges(source.mesh)
        self._reference_border = border_edges(reference)
        self._samples = SurfaceSampler(source.mesh).of(source.mesh)
        self._sampler = SurfaceSampler(reference)

    def from_reference(self, mesh: TriangleMesh, limits: Limits, inset: float = 0.0) -> Pairs:
        """Samples of the deformed reference and their places on the source.

        Samples whose partner lies on the border of a hole have none: the hole is where the source has no surface.
        inset : scene units. Samples without a partner that stick out of the source, or lie less deep than this in it, have their
        place this deep below it: surface that the source does not show can only be inside. 0 leaves them alone.
        """
        asked = self._sampler.of(mesh).every(limits.stride)
        allowed = lambda sample, triangle: self._allowed(asked.corners[sample, 0], triangle)
        paired, lonely = _partners(asked, self._source, self._normals, limits, allowed)
        at, found = _off_border(self._source.mesh, self._source_border, *paired)
        apart = _apart(asked.points[at] - found.points, self._normals[found.triangles], limits)
        targets = found.points
        if inset:
            out, below = _off_border(self._source.mesh, self._source_border, *self._shallow(asked, *lonely, inset))
            normals = self._normals[below.triangles]
            at, found = np.concatenate([at, out]), _joined(found, below)
            targets, apart = np.concatenate([targets, below.points - inset * normals]), np.concatenate([apart, normals])
        return Pairs(asked.corners[at], asked.shares[at], targets, apart, found.distances, _trusted(asked, at, found, limits))

    def from_source(self, mesh: TriangleMesh, limits: Limits, beside: bool = False) -> Pairs:
        """Samples of the source and their places on the deformed reference: reaches what the reference has missed.

        beside : samples without a partner belong to the closest surface that is not turned away from them. Thus the walls of a crease
        come together at its bottom, which faces neither.
        """
        asked, normals = self._samples.every(limits.stride), triangle_normals(mesh)
        allowed = lambda sample, triangle: self._allowed(mesh.triangles[triangle, 0], asked.triangles[sample])
        index = SurfaceIndex(mesh)
        (at, found), (lonely, _) = _partners(asked, index, normals, limits, allowed)
        if beside:
            nearest = index.query(asked.points[lonely], limits.distance, _fitting(asked, lonely, normals, BESIDE, allowed))
            near = nearest.triangles >= 0
            at, found = np.concatenate([at, lonely[near]]), _joined(found, _chosen(nearest, near))
        at, found = _off_border(mesh, self._reference_border, at, found)
        corners, targets = mesh.triangles[found.triangles], asked.points[at]
        shares, apart = barycentric(found.points, mesh.vertices[corners]), _apart(found.points - targets, normals[found.triangles], limits)
        return Pairs(corners, shares, targets, apart, found.distances, _trusted(asked, at, found, limits))

    def _shallow(self, asked: SurfaceSamples, at: np.ndarray, found: ClosestPoints, inset: float) -> tuple[np.ndarray, ClosestPoints]:
        """Of samples and their closest points on the source those that are not deep inside their own body."""
        kept = self._allowed(asked.corners[at, 0], found.triangles)
        at, found = at[kept], _chosen(found, kept)
        heights = row_dot(asked.points[at] - found.points, self._normals[found.triangles])
        shallow = (found.distances < inset) & (heights < -UPRIGHT * found.distances)
        kept = np.where(self._enclosed(asked.points[at]), shallow, heights > 0)
        return at[kept], _chosen(found, kept)

    def _allowed(self, vertex: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        return np.ones(len(vertex), dtype=bool) if self._compatible is None else self._compatible(vertex, triangle)


def _partners(
    asked: SurfaceSamples, surface: SurfaceIndex, normals: np.ndarray, limits: Limits, allowed: Allowed
) -> tuple[tuple[np.ndarray, ClosestPoints], tuple[np.ndarray, ClosestPoints]]:
    """Positions (K,) of the samples that have a partner on the surface, and the partners; and those without, and what is closest.

    The partner is the closest point, where that may be. Where it may not (the other side of a thin part, or of a contact),
    it is the closest one that may, and then only if it lies straight above or below: else the surface that belongs
    to the sample ends there, and what lies beside it is no partner. What has nothing in reach is in neither list.
    """
    found = surface.query(asked.points, limits.distance)
    near = np.flatnonzero(found.triangles >= 0)
    good = _fitting(asked, near, normals, limits.cosine, allowed)(np.arange(len(near)), found.triangles[near])
    first, refused = near[good], near[~good]
    again = surface.query(asked.points[refused], limits.distance, _fitting(asked, refused, normals, limits.cosine, allowed))
    offsets = np.abs(row_dot(asked.points[refused] - again.points, normals[again.triangles]))
    upright = (again.triangles >= 0) & (offsets > UPRIGHT * again.distances)
    partners = np.concatenate([first, refused[upright]]), _joined(_chosen(found, first), _chosen(again, upright))
    return partners, (refused[~upright], _chosen(found, refused[~upright]))


def _fitting(asked: SurfaceSamples, samples: np.ndarray, normals: np.ndarray, cosine: float, allowed: Allowed) -> Allowed:
    """Whether each of some of the samples, by position among these, may have a triangle: their normals agree, and nothing forbids it."""

    def fitting(query: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        good = row_dot(asked.normals[samples[query]], normals[triangle]) > cosine
        good[good] = allowed(samples[query[good]], triangle[good])
        return good

    return fitting


def _off_border(mesh: TriangleMesh, border: np.ndarray, at: np.ndarray, found: ClosestPoints) -> tuple[np.ndarray, ClosestPoints]:
    """Of samples and their closest points on a mesh those that do not lie on its border, which `border_edges` tells."""
    inside = ~on_border(mesh, border, found.triangles, found.points)
    return at[inside], _chosen(found, inside)


def _trusted(asked: SurfaceSamples, at: np.ndarray, found: ClosestPoints, limits: Limits) -> np.ndarray:
    """Weights (K,) of samples at these positions: Tukey's biweight fades out what is nearly too far, where chance pairs are many."""
    return asked.weights[at] * (1.0 - (found.distances / limits.distance) ** 2) ** 2


def _chosen(found: ClosestPoints, which: np.ndarray) -> ClosestPoints:
    return ClosestPoints(found.points[which], found.triangles[which], found.distances[which])


def _joined(one: ClosestPoints, other: ClosestPoints) -> ClosestPoints:
    both = [(getattr(one, name), getattr(other, name)) for name in ("points", "triangles", "distances")]
    return ClosestPoints(*map(np.concatenate, both))


def _apart(offsets: np.ndarray, normals: np.ndarray, limits: Limits) -> np.ndarray:
    """Unit directions of (K, 3) offsets to closest points; the triangle's normal where a point lies on the surface.

    Inside a triangle both are the same line. On an edge, rounding decides which triangle was found, but not the direction.
    """
    touching = np.linalg.norm(offsets, axis=1) <= TOUCHING * limits.distance
    return np.where(touching[:, None], normals, normalized(offsets))
