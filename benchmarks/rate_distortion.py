"""Distortion of decoded frames, each way, and the mean saving between two curves of rate and distortion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial import cKDTree

from refmesh_addon.core.evaluation.sampled_surface import SampledSurface
from refmesh_addon.core.evaluation.visibility import unseen
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import triangle_normals, vertex_normals
from refmesh_addon.core.types import TriangleMesh

WAYS = ("source_to_decoded", "visible_to_source")
FORMULA = """PSNR = 10 log10(D^2 / MSE). D is the diagonal of the sequence's bounding box, MSE the mean over all frames of the mean squared
distance of {samples} points, sampled evenly by area on one surface, from the other. D1 is the distance to the nearest point of the
other surface, D2 that along the normal of the triangle which holds it. Each way stands by itself; visible_to_source leaves out decoded
surface in contacts and over holes, where the capture has none. Mbps = 8 bytes of the whole file * frames per second / frames / 10^6.
TVMC is the measure that TVMC published: between vertices and nearest vertices, along vertex normals, the better of both ways, by the
diagonal of each frame, mean of the frames. It is not comparable with the others."""


@dataclass(frozen=True)
class Squares:
    """Mean squared distances of one frame: D1 and D2 each way; and `tvmc`, as a PSNR in dB."""

    source_to_decoded: tuple[float, float]
    visible_to_source: tuple[float, float]
    tvmc: float


class MeasuredFrame:
    """A source frame, its samples drawn and its index built once for every codec that is measured against it."""

    def __init__(self, mesh: TriangleMesh, samples: int, seed: int):
        self.mesh, self._index, self._samples, self._seed = mesh, SurfaceIndex(mesh), samples, seed
        self._points = SampledSurface.of(mesh, samples, np.random.default_rng(seed)).points

    def squares(self, decoded: TriangleMesh) -> Squares:
        """Mean squared distances between this frame and a decoded one, scene units squared."""
        index = SurfaceIndex(decoded)
        sampled = SampledSurface.of(decoded, self._samples, np.random.default_rng(self._seed + 1))
        back = self._index.query(sampled.points)
        hidden = unseen(index, self._index, sampled, back)
        there = _mean_squares(self._points, index.query(self._points), decoded)
        seen = _mean_squares(sampled.points, back, self.mesh, ~hidden)
        return Squares(there, seen, max(_vertex_psnr(self.mesh, decoded), _vertex_psnr(decoded, self.mesh)))


def _mean_squares(points: np.ndarray, closest, mesh: TriangleMesh, chosen: np.ndarray | slice = slice(None)) -> tuple[float, float]:
    """Mean squared distance to the closest points, and that along the normals of their triangles."""
    difference = (points - closest.points)[chosen]
    along = np.einsum("ij,ij->i", difference, triangle_normals(mesh)[closest.triangles[chosen]])
    return float((difference**2).sum(axis=1).mean()), float((along**2).mean())


def _vertex_psnr(first: TriangleMesh, second: TriangleMesh) -> float:
    """What TVMC's scripts measure from one mesh to another, dB."""
    nearest = cKDTree(second.vertices).query(first.vertices)[1]
    along = np.einsum("ij,ij->i", first.vertices - second.vertices[nearest], vertex_normals(second)[nearest])
    return psnr(float((along**2).mean()), first.diagonal)


def psnr(mean_square: float, diagonal: float) -> float:
    """In dB."""
    return float(10.0 * np.log10(diagonal**2 / max(mean_square, np.finfo(float).tiny)))


def mean_saving(rates: list[float], quality: list[float], base_rates: list[float], base_quality: list[float]) -> float | None:
    """BD-rate: by what share the rate differs from the base at equal quality, on average over the quality that both curves reach.

    Bjontegaard, VCEG-M33; logarithms of rates interpolated by monotone cubics. None where the curves do not overlap.
    """
    curve, base = _curve(rates, quality), _curve(base_rates, base_quality)
    low, high = max(curve.x[0], base.x[0]), min(curve.x[-1], base.x[-1])
    if low >= high:
        return None
    return float(np.exp((curve.integrate(low, high) - base.integrate(low, high)) / (high - low)) - 1.0)


def rate_at(rates: list[float], quality: list[float], goal: float) -> float | None:
    """The rate at which a curve reaches a quality; None where it does not."""
    curve = _curve(rates, quality)
    return float(np.exp(curve(goal))) if curve.x[0] <= goal <= curve.x[-1] else None


def _curve(rates: list[float], quality: list[float]) -> PchipInterpolator:
    """Logarithm of the rate over quality, from the points that no other of the curve beats."""
    order = np.argsort(quality)
    kept: list[int] = []
    for index in order[::-1]:
        if not kept or rates[index] < rates[kept[-1]]:
            kept.append(int(index))
    chosen = kept[::-1]
    return PchipInterpolator(np.array(quality)[chosen], np.log(np.array(rates)[chosen]))
