"""The values of a vertex animation texture: offsets from the first frame between bounds, and normals, in 16 bits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.geometry.mesh import vertex_normals
from ...core.geometry.vectors import normalized, row_dot
from ...core.types import FrozenArrays, TriangleMesh
from .arrangement import Arrangement

WHOLE = (1 << 16) - 1  # of a channel with 16 bits


@dataclass(frozen=True)
class EncodedFrames(FrozenArrays):
    """Positions and normals in textures of one arrangement.

    positions : (H, W, 3) uint16.  normals : (H, W, 3) uint16, None where they are in the lower half of `positions`.
    low, high : (3,) offsets of the values 0 and WHOLE, scene units.
    largest, rms : what 16 bits move a vertex by, scene units.  degrees : what they turn a normal by at most.
    """

    positions: np.ndarray
    normals: np.ndarray | None
    low: np.ndarray
    high: np.ndarray
    largest: float
    rms: float
    degrees: float


def encoded_frames(frames: np.ndarray, triangles: np.ndarray, arrangement: Arrangement) -> EncodedFrames:
    """Textures of (F, V, 3) frames, in the axes in which they are to be stored.  triangles : (T, 3)."""
    offsets = frames - frames[0]
    low, high = offsets.min(axis=(0, 1)), offsets.max(axis=(0, 1))
    size = np.where(high > low, high - low, 1.0)
    directions = np.stack([vertex_normals(TriangleMesh(frame, triangles)) for frame in frames])
    places, turns = np.rint(WHOLE * (offsets - low) / size), np.rint(WHOLE * (0.5 + 0.5 * directions))
    moved = np.linalg.norm(low + places / WHOLE * size - offsets, axis=-1)
    cosines = row_dot(normalized(2.0 * turns / WHOLE - 1.0).reshape(-1, 3), normalized(directions).reshape(-1, 3))
    lit = np.abs(directions).max(axis=-1).ravel() > 0  # vertices without a triangle have no normal
    positions, normals = _textures(places, turns, arrangement)
    worst = np.degrees(np.arccos(np.clip(cosines[lit].min(initial=1.0), -1.0, 1.0)))
    return EncodedFrames(positions, normals, low, high, float(moved.max()), float(np.sqrt((moved**2).mean())), float(worst))


def _textures(places: np.ndarray, turns: np.ndarray, arrangement: Arrangement) -> tuple[np.ndarray, np.ndarray | None]:
    rows, columns = arrangement.texels()
    shape = (arrangement.height, arrangement.width, 3)
    positions, normals = np.zeros(shape, np.uint16), np.zeros(shape, np.uint16)
    positions[rows, columns] = places
    if arrangement.packed:
        positions[rows + arrangement.height // 2, columns] = turns
        return positions, None
    normals[rows, columns] = turns
    return positions, normals
