"""Colors for distances: from dark blue for zero through green to yellow at the top of the scale and beyond."""

from __future__ import annotations

import numpy as np

TOP = 0.002  # share of the bounding-box diagonal at the bright end: a misfit of this size is visible in a close view
# sRGB, at even steps; lightness rises evenly, so that the order survives printing and color blindness.
TABLE = np.array([(0.16, 0.10, 0.36), (0.20, 0.33, 0.58), (0.14, 0.57, 0.55), (0.47, 0.78, 0.36), (0.99, 0.91, 0.22)])


def error_colors(shares: np.ndarray) -> np.ndarray:
    """(V, 4) uint8 sRGB and alpha for (V,) distances as shares of the bounding-box diagonal."""
    positions = np.clip(np.asarray(shares) / TOP, 0.0, 1.0)
    steps = np.linspace(0.0, 1.0, len(TABLE))
    channels = [np.interp(positions, steps, TABLE[:, channel]) for channel in range(3)]
    return np.rint(255 * np.stack([*channels, np.ones_like(positions)], axis=-1)).astype(np.uint8)


def to_linear(colors: np.ndarray) -> np.ndarray:
    """Linear colors, as Blender computes with, from sRGB, both 0 to 1."""
    return np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
