"""Exposure evened over a take: one gain per frame and channel, from texels that two frames both see."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..evaluation.error_scale import to_linear

DARK, BRIGHT = 8, 247  # texels outside are noise or clipped, and say nothing about exposure
LEAST_TEXELS = 100  # fewer in common give no gain
LINEAR = to_linear(np.arange(256) / 255.0)  # of each 8-bit sRGB value


def gain_between(reference: np.ndarray, colors: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(3,) linear gain per channel that brings a frame to the reference: the median ratio over texels seen in both.

    reference, colors : (N, 3) uint8 sRGB, of the same texels.  seen : (N,) bool. Ones where too few texels can be compared.
    """
    result = np.ones(3)
    for channel in range(3):
        one, other = reference[seen, channel], colors[seen, channel]
        usable = (np.minimum(one, other) > DARK) & (np.maximum(one, other) < BRIGHT)
        if np.count_nonzero(usable) >= LEAST_TEXELS:
            result[channel] = np.median(LINEAR[one[usable]] / LINEAR[other[usable]])
    return result


def evened(gains: Iterable[np.ndarray]) -> np.ndarray:
    """(F, 3) gains scaled so that their geometric mean over the take is 1: the take as a whole keeps its exposure."""
    logs = np.log(np.stack(list(gains)))
    return np.exp(logs - logs.mean(axis=0))


def exposed(colors: np.ndarray, gain: np.ndarray) -> np.ndarray:
    """(N, 3) uint8 sRGB colors times a (3,) linear gain; what gets too bright is clipped."""
    table = np.clip(np.rint(255.0 * _to_srgb(LINEAR[:, None] * gain)), 0, 255).astype(np.uint8)
    return np.stack([table[colors[:, channel], channel] for channel in range(3)], axis=1)


def _to_srgb(values: np.ndarray) -> np.ndarray:
    """The inverse of `to_linear`, IEC 61966-2-1."""
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * np.maximum(values, 1e-12) ** (1 / 2.4) - 0.055)
