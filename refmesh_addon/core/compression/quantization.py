"""Residuals to integers and back, with the classes that their neighborhoods tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .coder import FRACTION, Coder, magnitude_classes

ROUNDING = 0.40  # a residual of so many steps above a multiple goes up: below a half, as small values cost fewer bits
TOWARDS_ZERO = 16  # a reconstructed value lies 1 / TOWARDS_ZERO of a step below its multiple, where its residuals are


@dataclass(frozen=True)
class Step:
    """Quantization step of (K,) channels.  rounding : share of a step from which a residual is rounded up."""

    sizes: np.ndarray
    rounding: float = ROUNDING


def coded(coder: Coder, residuals: np.ndarray | None, expected: np.ndarray, step: Step) -> tuple[np.ndarray, np.ndarray]:
    """(N, K) integers as coded, and the residuals that they stand for, grid units.

    residuals : (N, K), None when decoding.  expected : (N, K) expected magnitudes of the integers, in 1 / FRACTION.
    """
    values = None
    if residuals is not None:
        share = residuals / step.sizes
        values = (np.sign(share) * np.floor(np.abs(share) + step.rounding)).astype(np.int64).ravel()
    integers = coder.integers(values, magnitude_classes(expected).ravel()).reshape(expected.shape)
    return integers, dequantized(integers, step)


def dequantized(integers: np.ndarray, step: Step) -> np.ndarray:
    """Residuals in float64, whole numbers of grid units.  integers : (N, K)."""
    return np.sign(integers) * np.rint((np.abs(integers) * TOWARDS_ZERO - 1) * step.sizes / TOWARDS_ZERO)


def expectation(ring: np.ndarray, previous: np.ndarray) -> np.ndarray:
    """(N, K) expected magnitudes in 1 / FRACTION: of the neighbors, of the channel's mean there, and of the channel before.

    ring : (N, K) mean magnitude of the neighbors, in 1 / FRACTION.  previous : (N, K) magnitudes.
    """
    mean = ring.sum(axis=0) // max(len(ring), 1)
    return (4 * mean + 8 * ring + 2 * FRACTION * previous) // 14
