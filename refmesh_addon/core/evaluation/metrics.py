"""How far two surfaces, or two volumes, are apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import sample_surface, triangle_normals
from ..types import FrozenArrays, TriangleMesh
from .visibility import unseen

PSNR_CEILING = 999.99  # dB, stands for "no difference": JSON has no infinity


@dataclass(frozen=True)
class Distance:
    """One-sided surface distance, each figure a share of the source's bounding-box diagonal."""

    mean: float
    rms: float
    p99: float
    max: float


@dataclass(frozen=True)
class TwoSidedDistance:
    """Distances both ways and PSNR in dB, the worse of the two directions each.

    visible_to_source : from the deformed surface where the source has a surface: outside contacts and holes.
    unseen : share of the deformed surface where it has none.
    """

    source_to_deformed: Distance
    deformed_to_source: Distance
    visible_to_source: Distance
    unseen: float
    d1_psnr: float
    d2_psnr: float


@dataclass(frozen=True)
class MeasuredFrame(FrozenArrays):
    """How far a deformed mesh is from its source.

    distances : two-sided.  errors : (R,) of each deformed vertex, shares of the source's bounding-box diagonal.
    """

    distances: TwoSidedDistance
    errors: np.ndarray


def surface_distance(source: TriangleMesh, deformed: TriangleMesh, samples: int, rng: np.random.Generator) -> TwoSidedDistance:
    """Two-sided distance between two surfaces (Aspert 2002, as in the paper), from points sampled evenly by area.

    samples : points sampled on each surface; each measures its exact distance to the other surface.

    Raises ValueError for a mesh without area.
    """
    clouds = [_Cloud(mesh, *sample_surface(mesh, samples, rng)) for mesh in (source, deformed)]
    surfaces = [SurfaceIndex(mesh) for mesh in (source, deformed)]
    there, back = surfaces[1].query(clouds[0].points), surfaces[0].query(clouds[1].points)
    hidden = unseen(surfaces[1], surfaces[0], (clouds[1].points, clouds[1].triangles), back)
    d1, d2 = _psnr_both(clouds[0], clouds[1], source.diagonal)
    ways = (there.distances, back.distances, back.distances[~hidden])
    outward, inward, visible = (_distance(way / source.diagonal) for way in ways)
    return TwoSidedDistance(outward, inward, visible, float(hidden.mean()), d1, d2)


class _Cloud:
    """Sampled points (N, 3) on (N,) triangles, with their (N, 3) unit normals."""

    def __init__(self, mesh: TriangleMesh, points: np.ndarray, triangles: np.ndarray):
        self.points, self.triangles, self.normals = points, triangles, triangle_normals(mesh)[triangles]


def _distance(shares: np.ndarray) -> Distance:
    """Of distances as shares of the diagonal; of none, all figures are 0."""
    shares = shares if len(shares) else np.zeros(1)
    return Distance(float(shares.mean()), float(np.sqrt((shares**2).mean())), float(np.percentile(shares, 99)), float(shares.max()))


def _psnr_both(first: _Cloud, second: _Cloud, peak: float) -> tuple[float, float]:
    """D1 (point-to-point) and D2 (point-to-plane) PSNR of two sampled clouds, dB, as MPEG's point-cloud metrics define them.

    peak : scene units, here the bounding-box diagonal. PSNR = 10 log10(peak^2 / MSE) with the larger of the two
    directions' mean squared errors. MPEG writes 3 p^2 for peak^2 with p the longest side of the box: the same for a cube, at most
    4.8 dB more for any other box.

    D1 has a floor: clouds sampled from one surface lie about half a sample spacing apart. PSNR_CEILING where nothing differs.
    """
    errors = np.array([_mean_squares(first, second), _mean_squares(second, first)])
    point, plane = errors.max(axis=0)
    return _psnr(point, peak), _psnr(plane, peak)


def _mean_squares(cloud: _Cloud, reference: _Cloud) -> tuple[float, float]:
    nearest = cKDTree(reference.points).query(cloud.points, workers=-1)[1]
    difference = cloud.points - reference.points[nearest]
    along_normal = np.einsum("ij,ij->i", difference, reference.normals[nearest])
    return np.einsum("ij,ij->i", difference, difference).mean(), (along_normal**2).mean()


def _psnr(mean_square: float, peak: float) -> float:
    if mean_square <= 0:
        return PSNR_CEILING
    return float(min(10.0 * np.log10(peak**2 / mean_square), PSNR_CEILING))


def per_vertex_error(deformed: TriangleMesh, source_index: SurfaceIndex) -> np.ndarray:
    """(R,) distance of each vertex to the source surface, scene units."""
    return source_index.query(deformed.vertices).distances


def iou(a: np.ndarray, b: np.ndarray) -> float:
    """Shared over joint volume of two boolean grids of one shape, 0 to 1; two empty grids are equal: 1."""
    if a.shape != b.shape:
        raise ValueError(f"grids must have one shape; got {a.shape} and {b.shape}")
    joint = np.count_nonzero(a | b)
    return np.count_nonzero(a & b) / joint if joint else 1.0


def measure(source: TriangleMesh, deformed: TriangleMesh, samples: int) -> MeasuredFrame:
    """Two-sided distance and the error of each deformed vertex."""
    errors = per_vertex_error(deformed, SurfaceIndex(source)) / source.diagonal
    return MeasuredFrame(surface_distance(source, deformed, samples, np.random.default_rng(0)), errors)
