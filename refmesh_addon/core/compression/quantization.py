"""Residuals to integers and back, with the classes that their neighborhoods tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .coder import FRACTION, Coder, magnitude_classes

RATE_WEIGHT = 0.13  # squared steps of error that a bit is worth: near (ln 2) / 6, what a bit saves at high rates


@dataclass(frozen=True)
class Step:
    """Quantization step of (K,) channels, grid units.

    rate_weight : squared steps of error that a bit is worth to an encoder.
    shrink : share of a step by which a residual lies below its integer.
    """

    sizes: np.ndarray
    rate_weight: float = RATE_WEIGHT
    shrink: float = 0.0


def coded(coder: Coder, residuals: np.ndarray | None, expected: np.ndarray, step: Step) -> tuple[np.ndarray, np.ndarray]:
    """(N, K) integers as coded, and the residuals that they stand for, whole grid units in float64.

    residuals : (N, K), None when decoding.  expected : (N, K) expected magnitudes of the integers, in 1 / FRACTION.
    """
    values = None if residuals is None else _chosen(residuals / step.sizes, expected, step.rate_weight).ravel()
    integers = coder.integers(values, magnitude_classes(expected).ravel()).reshape(expected.shape)
    return integers, np.rint((integers - step.shrink * np.sign(integers)) * step.sizes)


def _chosen(shares: np.ndarray, expected: np.ndarray, rate_weight: float) -> np.ndarray:
    """(N, K) int64 of the least squared error plus `rate_weight` times the bits.

    Of integers k whose frequencies fall as q^|k|, the next costs -log2 q bits more; the mean magnitude m gives q = (sqrt(1 + m^2) - 1) / m.
    """
    mean = np.maximum(expected, 1) / FRACTION
    bits = -np.log2((np.sqrt(1.0 + mean**2) - 1.0) / mean)
    return (np.sign(shares) * np.floor(np.abs(shares) + np.maximum(0.5 - 0.5 * rate_weight * bits, 0.0))).astype(np.int64)


def expectation(ring: np.ndarray, previous: np.ndarray) -> np.ndarray:
    """(N, K) expected magnitudes in 1 / FRACTION: of the neighbors, of the channel's mean there, and of the channel before.

    ring : (N, K) mean magnitude of the neighbors, in 1 / FRACTION.  previous : (N, K) magnitudes.
    """
    mean = ring.sum(axis=0) // max(len(ring), 1)
    return (4 * mean + 8 * ring + 2 * FRACTION * previous) // 14
