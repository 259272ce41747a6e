"""The mesh at rest: every vertex from coarser ones, normals finer than tangents."""

from __future__ import annotations

import numpy as np

from .coder import FRACTION, Coder
from .interpolation import interpolated
from .quantization import Step, coded
from .surface_frames import along_frames, from_frames, surface_frames
from .topology import Topology

TANGENT_RATIO = 4  # steps along tangents over those along normals: a vertex may slide on its surface
RATE_WEIGHT, SHRINK = 0.1, 1 / 16  # as for `Step`; all frames inherit what is lost here
GREATEST_BOUND = 1 << 24  # of whole steps along an axis
HIGHEST_RATIO = 8  # of the neighbors' magnitudes over those of the level


def coded_rest(coder: Coder, topology: Topology, step: int, target: np.ndarray | None) -> np.ndarray:
    """(V, 3) whole positions, grid units.

    step : along normals, grid units.  target : (V, 3) positions from 0 on; None when decoding.
    """
    points, magnitudes = np.zeros((topology.count, 3)), np.zeros((topology.count, 3), dtype=np.int64)
    points[topology.coarsest] = _coarsest(coder, step, len(topology.coarsest), None if target is None else target[topology.coarsest])
    sizes = Step(np.array([step, TANGENT_RATIO * step, TANGENT_RATIO * step], dtype=np.float64), RATE_WEIGHT, SHRINK)
    for level, equations in zip(topology.levels, topology.stencils):
        fine = level.fine
        points[fine] = predicted = interpolated(equations, points)
        frames = surface_frames(level.triangles, points, fine)
        residuals = None if target is None else along_frames(frames, target[fine] - predicted)
        ring = equations.mean_magnitudes(magnitudes)
        integers, along = coded(coder, residuals, _expected(coder, residuals, ring, sizes), sizes)
        points[fine] = predicted + from_frames(frames, along)
        magnitudes[fine] = np.abs(integers)
    return points


def _coarsest(coder: Coder, step: int, count: int, target: np.ndarray | None) -> np.ndarray:
    """(C, 3) positions of the coarsest level, plainly: whole steps along each axis."""
    given = None if target is None else np.maximum(np.rint(target / step), 0).astype(np.int64).ravel()
    bound = coder.number(None if given is None else int(given.max(initial=0)) + 1, GREATEST_BOUND)
    rows = [coder.number(None if given is None else int(given[index]), bound) for index in range(3 * count)]
    return np.array(rows, dtype=np.float64).reshape(-1, 3) * step


def _expected(coder: Coder, residuals: np.ndarray | None, ring: np.ndarray, step: Step) -> np.ndarray:
    """Expected magnitudes in 1 / FRACTION: the level's mean, which is coded, half of it in the proportions of the neighbors'."""
    means = np.zeros(3, dtype=np.int64)
    for axis in (0, 1):
        exact = None if residuals is None else _quarter_octave(np.abs(residuals[:, axis : 2 * axis + 1]).mean() / step.sizes[axis])
        means[axis] = _from_quarter_octave(coder.number(exact, 128))
    means[2] = means[1]
    around = np.maximum(ring.sum(axis=0) // len(ring), 1)
    return (means + np.minimum(means * ring // around, HIGHEST_RATIO * means)) // 2


def _quarter_octave(mean: float) -> int:
    return int(np.clip(np.rint(4 * np.log2(max(mean * FRACTION, 1.0))), 0, 127))


def _from_quarter_octave(code: int) -> int:
    """About 2^(code / 4), by integers."""
    return (1 << (code // 4)) * (100, 119, 141, 168)[code % 4] // 100
