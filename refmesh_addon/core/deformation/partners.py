"""The partner of a sample on another surface: the closest point that faces the same way and is allowed."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ..geometry.closest_point import Allowed, ClosestPoints, SurfaceIndex
from ..geometry.vectors import row_dot
from ..types import FrozenArrays
from .surface_samples import SurfaceSamples

STRAIGHT = 0.7  # least cosine between offset and normal for what counts as straight above or below a surface, and not beside it
PERPENDICULAR = 0.99  # least cosine between the offset of a closest point and the normal of its triangle where it lies within that
NEAR = 0.02  # share of the greatest distance below which the direction of an offset does not matter


@dataclass(frozen=True)
class Limits:
    """distance : the farthest partner, scene units.  cosine : least agreement of the two normals.  stride : every n-th sample is used."""

    distance: float
    cosine: float
    stride: int = 1

    def confidence(self, distances: np.ndarray) -> np.ndarray:
        """(K,) from 1 to 0: Tukey's biweight fades out pairs that are nearly too far apart, many of which are accidental."""
        return (1.0 - (distances / self.distance) ** 2) ** 2


@dataclass(frozen=True)
class Partners(FrozenArrays):
    """K of the samples, each with a point of the other surface.

    samples : (K,) positions in the list of samples.  points : (K, 3) on the other surface, scene units.
    triangles : (K,) that hold them.  distances : (K,) scene units.
    """

    samples: np.ndarray
    points: np.ndarray
    triangles: np.ndarray
    distances: np.ndarray

    @classmethod
    def of(cls, samples: np.ndarray, closest: ClosestPoints) -> Partners:
        """K samples and what is closest to each."""
        return cls(samples, closest.points, closest.triangles, closest.distances)

    def where(self, chosen: np.ndarray) -> Partners:
        """Those that are marked or listed in `chosen`."""
        return Partners(*(getattr(self, item.name)[chosen] for item in fields(self)))

    def joined(self, other: Partners) -> Partners:
        """These and the others."""
        return Partners(*(np.concatenate([getattr(self, item.name), getattr(other, item.name)]) for item in fields(self)))


def closest_partners(
    samples: SurfaceSamples, surface: SurfaceIndex, normals: np.ndarray, limits: Limits, allowed: Allowed, beside: bool = False
) -> tuple[Partners, Partners]:
    """The samples that have a partner on the surface, with it; and those that have none, with the closest point.

    normals : (T, 3) of the surface's triangles.  beside : whether it may lie beside the sample, as beyond a border.
    Samples with nothing within the distance are in neither.

        o sample             o sample             o sample
        |                    |                      \\
        |                    |   ===              === \\
    ----x----            ----x----                      x----

    Left: the closest point fits, and is the partner. Middle and right: the closest point lies on surface that does not fit (===,
    the other side of a thin part, or another body in contact). The closest point of what fits is the partner if it lies straight
    above or below. If it lies beside, the sample's own surface ends there, and the sample has no partner. This holds for the closest
    point as well where it lies on an edge of the surface, as a crease is for the walls of a contact that ends there.
    """
    closest = Partners.of(np.arange(len(samples.points)), surface.query(samples.points, limits.distance))
    closest = closest.where(closest.triangles >= 0)
    fits = fitting(samples, closest.samples, normals, limits.cosine, allowed)
    good = fits(np.arange(len(closest.samples)), closest.triangles)
    if not beside:
        good &= _across(samples, closest, normals, limits)
    refused = closest.where(~good)
    points, fits = samples.points[refused.samples], fitting(samples, refused.samples, normals, limits.cosine, allowed)
    second = Partners.of(refused.samples, surface.query(points, limits.distance, fits))
    heights = np.abs(row_dot(points - second.points, normals[second.triangles]))
    above = (second.triangles >= 0) & (heights > STRAIGHT * second.distances)
    return closest.where(good).joined(second.where(above)), refused.where(~above)


def _across(samples: SurfaceSamples, partners: Partners, normals: np.ndarray, limits: Limits) -> np.ndarray:
    """(K,) bool, whether partners lie within a triangle, or straight above or below the sample, and not on an edge beside it.

    normals : (T, 3) of the triangles.
    """
    offsets = samples.points[partners.samples] - partners.points
    straight = np.abs(row_dot(samples.normals[partners.samples], offsets)) >= STRAIGHT * partners.distances
    within = np.abs(row_dot(normals[partners.triangles], offsets)) >= PERPENDICULAR * partners.distances
    return straight | within | (partners.distances <= NEAR * limits.distance)


def fitting(samples: SurfaceSamples, chosen: np.ndarray, normals: np.ndarray, cosine: float, allowed: Allowed) -> Allowed:
    """Whether a chosen sample, by its position among the (K,) chosen, may have a triangle: it faces the same way and is allowed.

    normals : (T, 3) of the triangles.  cosine : least agreement.  allowed : of samples and triangles.
    """

    def fits(query: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        good = row_dot(samples.normals[chosen[query]], normals[triangle]) > cosine
        good[good] = allowed(chosen[query[good]], triangle[good])
        return good

    return fits
