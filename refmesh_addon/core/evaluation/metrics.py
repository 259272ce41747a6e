"""Two-sided distance between a source frame and the reference mesh deformed to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..geometry.closest_point import SurfaceIndex
from ..types import FrozenArrays, TriangleMesh
from .distances import Distances, TwoSidedDistance
from .far_places import FAR, FarPlaces, extra_places, missing_places, no_places
from .psnr import d1_d2_psnr
from .sampled_surface import SampledSurface
from .visibility import unseen

SEED = 0  # of the sampled points: evaluating a frame twice gives the same figures


@dataclass(frozen=True)
class MeasuredFrame(FrozenArrays):
    """How far a deformed mesh is from its source.

    distances : two-sided.  errors : (R,) of each deformed vertex, shares of the source's bounding-box diagonal.
    extra : where the deformed surface is far from the source.  missing : where the source is far from the deformed surface.
    """

    distances: TwoSidedDistance
    errors: Annotated[np.ndarray, "(R) float64"]
    extra: FarPlaces
    missing: FarPlaces


def surface_distance(source: TriangleMesh, deformed: TriangleMesh, samples: int, rng: np.random.Generator) -> TwoSidedDistance:
    """Two-sided distance between two surfaces (Aspert 2002, as in the paper), from points sampled uniformly by area.

    samples : points sampled on each surface; each contributes its exact distance to the other surface.
    Raises ValueError for a mesh without area.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> distance = surface_distance(square, square.moved(square.vertices + [0, 0, 0.01]), 1000, np.random.default_rng(0))
    >>> round(distance.source_to_deformed.mean * square.diagonal, 6)
    0.01
    """
    return _distance(SurfaceIndex(source), SurfaceIndex(deformed), samples, rng)


def measure(source: TriangleMesh, deformed: TriangleMesh, samples: int) -> MeasuredFrame:
    """Two-sided distance, the error of each deformed vertex, and the places that are far off."""
    there, back = SurfaceIndex(source), SurfaceIndex(deformed)
    closest = there.query(deformed.vertices)
    distances = _distance(there, back, samples, np.random.default_rng(SEED))
    # The source's vertices are queried only where one of its samples is far already: a part of it that none hits is a speck.
    missing = missing_places(there, back) if distances.source_to_deformed.max > FAR else no_places()
    return MeasuredFrame(distances, closest.distances / source.diagonal, extra_places(back, there, closest), missing)


def source_distances(source: TriangleMesh, deformed: TriangleMesh, samples: int) -> Distances:
    """The distances from source to deformed mesh alone, equal to those of `measure`; holes of either need not be closed for them."""
    points = SampledSurface.of(source, samples, np.random.default_rng(SEED)).points
    return Distances.of(SurfaceIndex(deformed).query(points).distances / source.diagonal)


def _distance(source: SurfaceIndex, deformed: SurfaceIndex, samples: int, rng: np.random.Generator) -> TwoSidedDistance:
    on_source, on_deformed = (SampledSurface.of(index.mesh, samples, rng) for index in (source, deformed))
    diagonal = source.mesh.diagonal
    outward, inward = deformed.query(on_source.points), source.query(on_deformed.points)
    hidden = unseen(deformed, source, on_deformed, inward)
    there, back, visible = (
        Distances.of(distances / diagonal) for distances in (outward.distances, inward.distances, inward.distances[~hidden])
    )
    d1, d2 = d1_d2_psnr(on_source, on_deformed, diagonal)
    return TwoSidedDistance(there, back, visible, float(hidden.mean()), d1, d2)
