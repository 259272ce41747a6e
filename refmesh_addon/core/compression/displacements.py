"""What control nodes leave of the motion: coefficients over time at every vertex, predicted from coarser vertices."""

from __future__ import annotations

import numpy as np

from .coder import FRACTION, Coder
from .interpolation import interpolated
from .quantization import Step, coded, expectation
from .topology import Topology

COARSEST_EXPECTED = 4 * FRACTION  # magnitude at the coarsest level, which nothing predicts
FINER = 19, 20  # step of a level over that of the next finer one, as a fraction: what is built on it inherits its error ...
COARSENED = 12  # ... for so many levels


def coded_fields(coder: Coder, topology: Topology, steps: np.ndarray, channels: int, target: np.ndarray | None) -> np.ndarray:
    """(V, K, 3) whole coefficients of K channels, grid units.

    steps : (3,) along normal and tangents at the finest level, grid units.  target : (V, K, 3) coefficients; None when decoding.
    """
    values = np.zeros((topology.count, channels, 3))
    magnitudes = np.zeros((topology.count, channels, 3), dtype=np.int64)
    vertices = [topology.coarsest, *(level.fine for level in topology.levels)]
    for index, fine in enumerate(vertices):
        step = Step(_sizes(steps, len(vertices) - 1 - index))
        ring = np.full((len(fine), channels, 3), COARSEST_EXPECTED)
        if index:
            stencil = topology.stencils[index - 1]
            values[fine] = interpolated(stencil, values.reshape(topology.count, channels * 3)).reshape(ring.shape)
            ring = stencil.mean_magnitudes(magnitudes.reshape(topology.count, channels * 3)).reshape(ring.shape)
        before = np.zeros((len(fine), 3), dtype=np.int64)
        for channel in range(channels):
            residuals = None if target is None else target[fine, channel] - values[fine, channel]
            integers, change = coded(coder, residuals, expectation(ring[:, channel], before), step)
            values[fine, channel] += change
            magnitudes[fine, channel] = before = np.abs(integers)
    return values


def _sizes(steps: np.ndarray, above: int) -> np.ndarray:
    """(3,) whole steps of the level that is so many above the finest."""
    for _ in range(min(above, COARSENED)):
        steps = np.maximum(np.rint(steps * FINER[0] / FINER[1]), 1.0)
    return steps
