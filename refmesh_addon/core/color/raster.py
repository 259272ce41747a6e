"""Which pixel shows which triangle: scan conversion of triangles in the plane, for texture layouts and for unlit pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.ragged import ragged_indices
from ..types import FrozenArrays

BLOCK = 1 << 15  # triangles converted at once, so that long lists of spans stay small


@dataclass(frozen=True)
class Fragments(FrozenArrays):
    """pixels : (N,) int32, row * width + column.  triangles : (N,) int32.  shares : (N, 2) float32, weights of the second and third corner.

    A pixel is covered where its center is inside a triangle. Triangles that share an edge never both cover a center on it.
    """

    pixels: np.ndarray
    triangles: np.ndarray
    shares: np.ndarray


def rasterized(corners: np.ndarray, width: int, height: int) -> Fragments:
    """Fragments of all triangles, overlapping or not, in the order of the triangles.

    corners : (T, 3, 2) float64, pixels: x from the left edge, y from the top edge, so that the first center is at (0.5, 0.5).
    What lies beyond the picture is left out, as are triangles without area.
    """
    parts = [_rasterized(corners[at : at + BLOCK], width, height, at) for at in range(0, len(corners), BLOCK)]
    if not parts:
        return Fragments(np.empty(0, np.int32), np.empty(0, np.int32), np.empty((0, 2), np.float32))
    return Fragments(*(np.concatenate(column) for column in zip(*parts)))


def _rasterized(corners: np.ndarray, width: int, height: int, first: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    owners, rows = _rows(corners, height)
    left, right = _spans(corners, owners, rows)
    start = np.clip(np.ceil(left - 0.5), 0, width).astype(np.int64)
    end = np.clip(np.ceil(right - 0.5), 0, width).astype(np.int64)
    span, place = ragged_indices(np.maximum(end - start, 0))
    columns, triangles, lines = start[span] + place, owners[span], rows[span]
    second, third = shares_at(corners, triangles, columns + 0.5, lines + 0.5)
    pixels, triangles = (lines * width + columns).astype(np.int32), (triangles + first).astype(np.int32)
    shares = np.stack([second, third], axis=1, dtype=np.float32)
    kept = np.isfinite(second) & np.isfinite(third)
    return (pixels, triangles, shares) if kept.all() else (pixels[kept], triangles[kept], shares[kept])


def _rows(corners: np.ndarray, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Each triangle with each row whose centers it reaches."""
    a, b, c = corners[:, :, 1].T
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    start = np.clip(np.ceil(low - 0.5), 0, height).astype(np.int64)
    end = np.clip(np.ceil(high - 0.5), 0, height).astype(np.int64)
    owners, place = ragged_indices(np.maximum(end - start, 0))
    return owners, start[owners] + place


def _spans(corners: np.ndarray, owners: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the line through a row's centers enters and leaves a triangle.

    Each edge is cut from its upper to its lower end, whichever triangle it belongs to: neighbors round alike and leave no gap.
    """
    y, left, right = rows + 0.5, np.full(len(rows), np.inf), np.full(len(rows), -np.inf)
    for one, other in ((0, 1), (1, 2), (2, 0)):
        a, b = corners[:, one], corners[:, other]
        swapped = (a[:, 1] > b[:, 1]) | ((a[:, 1] == b[:, 1]) & (a[:, 0] > b[:, 0]))
        upper, lower = np.where(swapped[:, None], b, a), np.where(swapped[:, None], a, b)
        with np.errstate(divide="ignore", invalid="ignore"):  # level edges cross no row
            slope = (lower[:, 0] - upper[:, 0]) / (lower[:, 1] - upper[:, 1])
        crossed = (upper[owners, 1] <= y) & (y < lower[owners, 1])
        x = np.where(crossed, upper[owners, 0] + (y - upper[owners, 1]) * np.where(np.isfinite(slope), slope, 0.0)[owners], np.nan)
        left, right = np.fmin(left, x), np.fmax(right, x)
    return left, np.where(np.isfinite(right), right, left)


def shares_at(corners: np.ndarray, triangles: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights (N,) of the second and third corner of (N,) triangles at places (N,); not finite without area."""
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
        rows = np.stack([v[:, 1] * inverse, -v[:, 0] * inverse, -u[:, 1] * inverse, u[:, 0] * inverse])
        dx, dy = x - a[triangles, 0], y - a[triangles, 1]
        second = rows[0, triangles] * dx + rows[1, triangles] * dy
        third = rows[2, triangles] * dx + rows[3, triangles] * dy
    return second, third
