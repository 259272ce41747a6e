"""Correspondences between a deformed reference and a source surface: closest points that pass every check.

Both surfaces are sampled at their vertices and at the centroids of their triangles: with vertices alone, the reference would end up
with its vertices on the source and all its triangles inside, wherever the source is convex.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from scipy import sparse

from ..geometry.borders import barycentric, on_border
from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import triangle_normals
from ..geometry.vectors import normalized, row_dot
from ..geometry.winding import Enclosed, enclosed_by
from ..types import FrozenArrays, TriangleMesh
from .contact import faced
from .partners import STRAIGHT, Limits, Partners, closest_partners, fitting
from .surface_samples import SurfaceSampler, SurfaceSamples

# compatible(vertex_ids, triangle_ids) -> bool for each pair: may this reference vertex lie on this source triangle?
Compatible = Callable[[np.ndarray, np.ndarray], np.ndarray]

TOUCHING = 1e-6  # share of the greatest distance below which the direction of an offset is mostly rounding
DEEP = 0.5  # share of the greatest distance beyond which a sample inside the source may belong to a contact
BESIDE = -0.1  # least agreement of normals for the walls of a crease: perpendicular ones count


@dataclass(frozen=True)
class Pairs(FrozenArrays):
    """K points of the reference and their targets on the source.

    corners : (K, 3) reference vertices around the point.  shares : (K, 3) their barycentric weights.
    targets : (K, 3) scene units.  normals : (K, 3) unit directions in which the two surfaces are apart there.
    distances : (K,) from the point to its target, scene units.
    weights : (K,) the area that the point represents, relative to the mean over all samples, times its confidence.
    """

    corners: np.ndarray
    shares: np.ndarray
    targets: np.ndarray
    normals: np.ndarray
    distances: np.ndarray
    weights: np.ndarray

    def rows(self, count: int) -> sparse.csr_matrix:
        """(K, count) matrix that takes vertex positions to the K points."""
        index = np.repeat(np.arange(len(self.corners)), 3)
        used = self.shares.ravel() != 0
        return sparse.csr_matrix((self.shares.ravel()[used], (index[used], self.corners.ravel()[used])), shape=(len(self.corners), count))

    def where(self, chosen: np.ndarray) -> Pairs:
        """Those that are marked or listed in `chosen`."""
        return Pairs(*(getattr(self, item.name)[chosen] for item in fields(self)))

    def joined(self, other: Pairs) -> Pairs:
        """These and the others."""
        return Pairs(*(np.concatenate([getattr(self, item.name), getattr(other, item.name)]) for item in fields(self)))


class Correspondence:
    """Pairs of one source surface with any deformation of one reference.

    source : the frame's surface; seams (coinciding vertices) count as closed.
    reference : samples the reference mesh.
    compatible : pairs that it refuses are never formed; None allows all.
    enclosed : by the source; computed where it is None.
    is_open : whether the reference ends where the source does, so that what the source shows beyond its border pulls the border there.
    """

    def __init__(
        self,
        source: SurfaceIndex,
        reference: SurfaceSampler,
        compatible: Compatible | None = None,
        enclosed: Enclosed | None = None,
        is_open: bool = False,
    ):
        self.source, self._sampler, self._compatible, self._is_open = source, reference, compatible, is_open
        self._enclosed = enclosed or enclosed_by(source.mesh)
        self._normals = triangle_normals(source.mesh)
        source_sampler = SurfaceSampler(source.mesh)
        self._samples, self._border = source_sampler.of(source.mesh), source_sampler.border
        self._latest: SurfaceIndex | None = None

    def from_reference(self, mesh: TriangleMesh, limits: Limits, inset: float = 0.0) -> Pairs:
        """Samples of the deformed reference and their targets on the source.

        Samples whose partner lies on the border of a hole have none: the hole is where the source has no surface.
        inset : scene units. Samples without a partner that stick out of the source, or lie less deep than this inside it, get a
        target this deep below it: surface that the source does not show can only be inside. 0 gives them none.
        """
        samples = self._sampler.of(mesh).every(limits.stride)
        allowed = lambda sample, triangle: self._allowed(samples.corners[sample, 0], triangle)
        paired, unpaired = closest_partners(samples, self.source, self._normals, limits, allowed, self._is_open)
        paired = _off_border(self.source.mesh, self._border, self._outside_contacts(mesh, samples, paired, limits))
        offsets = samples.points[paired.samples] - paired.points
        directions = _directions(offsets, self._normals[paired.triangles], limits)
        pairs = _reference_pairs(samples, paired, paired.points, directions, limits)
        if not inset:
            return pairs
        below = _off_border(self.source.mesh, self._border, self._not_deep(samples, unpaired, inset))
        normals = self._normals[below.triangles]
        return pairs.joined(_reference_pairs(samples, below, below.points - inset * normals, normals, limits))

    def from_source(self, mesh: TriangleMesh, limits: Limits, beside: bool = False) -> Pairs:
        """Samples of the source and the points of the deformed reference that have them as targets: reaches what it has missed.

        beside : samples without a partner are paired with the closest surface that is not turned away from them. This brings the
        walls of a crease together at its bottom, which faces neither.
        """
        samples, normals = self._samples.every(limits.stride), triangle_normals(mesh)
        allowed = lambda sample, triangle: self._allowed(mesh.triangles[triangle, 0], samples.triangles[sample])
        index = self._index(mesh)
        paired, unpaired = closest_partners(samples, index, normals, limits, allowed, self._is_open)
        if beside:
            not_away = fitting(samples, unpaired.samples, normals, BESIDE, allowed)
            nearest = index.query(samples.points[unpaired.samples], limits.distance, not_away)
            paired = paired.joined(Partners.of(unpaired.samples, nearest).where(nearest.triangles >= 0))
        paired = paired if self._is_open else _off_border(mesh, self._sampler.border, paired)
        corners, targets = mesh.triangles[paired.triangles], samples.points[paired.samples]
        shares = barycentric(paired.points, mesh.vertices[corners])
        directions = _directions(paired.points - targets, normals[paired.triangles], limits)
        return Pairs(corners, shares, targets, directions, paired.distances, _weights(samples, paired, limits))

    def _outside_contacts(self, mesh: TriangleMesh, samples: SurfaceSamples, paired: Partners, limits: Limits) -> Partners:
        """Those without samples deep inside the source that other surface of the deformed reference covers.

        A wall of a contact that the source does not show would be pulled into the crease where the contact ends.
        """
        deep = np.flatnonzero(paired.distances > DEEP * limits.distance)
        deep = deep[self._enclosed(samples.points[paired.samples[deep]])]
        covered, at = np.zeros(len(paired.samples), dtype=bool), paired.samples[deep]
        if len(deep):
            covered[deep] = faced(samples.points[at], samples.normals[at], paired.distances[deep], self._index(mesh))
        return paired.where(~covered)

    def _index(self, mesh: TriangleMesh) -> SurfaceIndex:
        """Of a deformed reference; both directions of a round have the same."""
        if self._latest is None or self._latest.mesh is not mesh:
            self._latest = SurfaceIndex(mesh)
        return self._latest

    def _not_deep(self, samples: SurfaceSamples, unpaired: Partners, inset: float) -> Partners:
        """Those that stick out of their own body or lie in it less deep than the inset."""
        near = unpaired.where(self._allowed(samples.corners[unpaired.samples, 0], unpaired.triangles))
        points = samples.points[near.samples]
        heights = row_dot(points - near.points, self._normals[near.triangles])
        shallow = (near.distances < inset) & (heights < -STRAIGHT * near.distances)
        return near.where(np.where(self._enclosed(points), shallow, heights > 0))

    def _allowed(self, vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        return np.ones(len(vertices), dtype=bool) if self._compatible is None else self._compatible(vertices, triangles)


def _reference_pairs(samples: SurfaceSamples, paired: Partners, targets: np.ndarray, normals: np.ndarray, limits: Limits) -> Pairs:
    at = paired.samples
    return Pairs(samples.corners[at], samples.shares[at], targets, normals, paired.distances, _weights(samples, paired, limits))


def _off_border(mesh: TriangleMesh, border: np.ndarray, partners: Partners) -> Partners:
    """Those that do not lie on the border of the mesh, given as (T, 3) `border_edges`."""
    return partners.where(~on_border(mesh, border, partners.triangles, partners.points))


def _weights(samples: SurfaceSamples, paired: Partners, limits: Limits) -> np.ndarray:
    """(K,) area times confidence."""
    return samples.weights[paired.samples] * limits.confidence(paired.distances)


def _directions(offsets: np.ndarray, normals: np.ndarray, limits: Limits) -> np.ndarray:
    """Unit directions of (K, 3) offsets to closest points; the triangle's normal where the point lies on the surface.

    Inside a triangle both are the same line. On an edge, rounding decides which triangle is returned, but not the direction.
    """
    touching = np.linalg.norm(offsets, axis=1) <= TOUCHING * limits.distance
    return np.where(touching[:, None], normals, normalized(offsets))
