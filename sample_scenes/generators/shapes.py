"""Signed distances of simple solids: negative inside. Each factory returns field(points (N, 3)) -> (N,) float64."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Field = Callable[[np.ndarray], np.ndarray]


def ball(center, radius: float) -> Field:
    """A solid sphere."""
    center = np.asarray(center, dtype=float)
    return lambda points: np.linalg.norm(points - center, axis=1) - radius


def capsule(start, end, radius: float) -> Field:
    """All points within `radius` of the segment from `start` to `end`."""
    start, direction = np.asarray(start, dtype=float), np.subtract(end, start)

    def field(points: np.ndarray) -> np.ndarray:
        share = np.clip((points - start) @ direction / (direction @ direction), 0.0, 1.0)
        return np.linalg.norm(points - start - share[:, None] * direction, axis=1) - radius

    return field


def block(center, half_sides, rounding: float) -> Field:
    """A box with rounded edges; `half_sides` include the rounding."""
    center, core = np.asarray(center, dtype=float), np.subtract(half_sides, rounding)
    return lambda points: _rounded(np.abs(points - center) - core, rounding)


def disc(radius: float, half_height: float, rounding: float) -> Field:
    """A flat cylinder about the z axis with rounded rims, centered on the origin; radius and height include the rounding."""
    core = np.array([radius - rounding, half_height - rounding])

    def field(points: np.ndarray) -> np.ndarray:
        profile = np.column_stack([np.linalg.norm(points[:, :2], axis=1), np.abs(points[:, 2])])
        return _rounded(profile - core, rounding)

    return field


def gear(radius: float, tooth: float, teeth: int, half_height: float, rounding: float) -> Field:
    """A gear about the z axis: a flat cylinder whose radius goes up and down by `tooth` as often as it has teeth.

    Its rims are rounded. The values are distances but for a factor near 1, as the flanks are steep.
    """

    def field(points: np.ndarray) -> np.ndarray:
        rim = radius + tooth * np.cos(teeth * np.arctan2(points[:, 1], points[:, 0]))
        steepness = np.hypot(1.0, teeth * tooth / radius)
        across = (np.linalg.norm(points[:, :2], axis=1) - rim) / steepness
        return _rounded(np.column_stack([across, np.abs(points[:, 2]) - half_height]) + rounding, rounding)

    return field


def union(*fields: Field) -> Field:
    """Everything inside any of the solids."""
    return lambda points: np.min([field(points) for field in fields], axis=0)


def _rounded(excess: np.ndarray, rounding: float) -> np.ndarray:
    outside = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
    return outside + np.minimum(excess.max(axis=1), 0.0) - rounding
