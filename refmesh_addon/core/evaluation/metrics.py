"""Two-sided distance between a source frame and the reference mesh deformed to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.closest_point import SurfaceIndex
from ..types import FrozenArrays, TriangleMesh
from .distances import Distances, TwoSidedDistance
from .psnr import d1_d2_psnr
from .sampled_surface import SampledSurface
from .visibility import unseen

SEED = 0  # of the sampled points: evaluating a frame twice gives the same figures


@dataclass(frozen=True)
class MeasuredFrame(FrozenArrays):
    """How far a deformed mesh is from its source.

    distances : two-sided.  errors : (R,) of each deformed vertex, shares of the source's bounding-box diagonal.
    """

    distances: TwoSidedDistance
    errors: np.ndarray


def surface_distance(source: TriangleMesh, deformed: TriangleMesh, samples: int, rng: np.random.Generator) -> TwoSidedDistance:
    """Two-sided distance between two surfaces (Aspert 2002, as in the paper), from points sampled uniformly by area.

    samples : points sampled on each surface; each contributes its exact distance to the other surface.
    Raises ValueError for a mesh without area.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> distance = surface_distance(square, square.moved(square.vertices + [0, 0, 0.01]), 1000, np.random.default_rng(0))
    >>> round(distance.source_to_deformed.mean * square.diagonal, 6)
    0.01
    """
    return _distance(SurfaceIndex(source), deformed, samples, rng)


def per_vertex_error(deformed: TriangleMesh, source: SurfaceIndex) -> np.ndarray:
    """(R,) distance of each vertex to the source surface, scene units."""
    return source.query(deformed.vertices).distances


def measure(source: TriangleMesh, deformed: TriangleMesh, samples: int) -> MeasuredFrame:
    """Two-sided distance and the error of each deformed vertex."""
    index = SurfaceIndex(source)
    errors = per_vertex_error(deformed, index) / source.diagonal
    return MeasuredFrame(_distance(index, deformed, samples, np.random.default_rng(SEED)), errors)


def _distance(source: SurfaceIndex, deformed: TriangleMesh, samples: int, rng: np.random.Generator) -> TwoSidedDistance:
    on_source, on_deformed = (SampledSurface.of(mesh, samples, rng) for mesh in (source.mesh, deformed))
    index, diagonal = SurfaceIndex(deformed), source.mesh.diagonal
    outward, inward = index.query(on_source.points), source.query(on_deformed.points)
    hidden = unseen(index, source, on_deformed, inward)
    there, back, visible = (
        Distances.of(distances / diagonal) for distances in (outward.distances, inward.distances, inward.distances[~hidden])
    )
    d1, d2 = d1_d2_psnr(on_source, on_deformed, diagonal)
    return TwoSidedDistance(there, back, visible, float(hidden.mean()), d1, d2)
