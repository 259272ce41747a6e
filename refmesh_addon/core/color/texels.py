"""The texels of a layout, worked out once for all frames that share it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..types import FrozenArrays, TriangleMesh
from .layout import Layout
from .raster import rasterized

STRIDE = 4  # texels along the side of a block, of which one is looked up exactly; fewer miss less and take longer


@dataclass(frozen=True)
class Texels(FrozenArrays):
    """The covered texels of a square texture, block by block, so that neighbors in the picture are neighbors in memory.

    size : texels along a side.  pixels : (N,) int32, row * size + column, rows from the top.
    triangles : (N,) int32, of the reference mesh.  shares : (N, 2) float32, weights of the triangle's second and third corner.
    seeds : (M,) int32, one texel of each block and chart.  seed_of : (N,) int32, index into `seeds`.
    gutter : (G,) int32 pixels that no triangle covers.  nearest : (G,) int32, the texel next to each.
    """

    size: int
    pixels: np.ndarray
    triangles: np.ndarray
    shares: np.ndarray
    seeds: np.ndarray
    seed_of: np.ndarray
    gutter: np.ndarray
    nearest: np.ndarray

    @classmethod
    def of(cls, layout: Layout, size: int) -> Texels:
        """Rasterizes a layout. Where charts overlap, the triangle with the lowest index wins."""
        fragments = rasterized(layout.pixels(size), size, size)
        first = np.unique(fragments.pixels, return_index=True)[1]
        pixels, triangles, shares = (getattr(fragments, name)[first] for name in ("pixels", "triangles", "shares"))
        order, starts, seed_of = _blocks(pixels, layout.charts()[triangles], size)
        pixels, triangles, shares = pixels[order], triangles[order], shares[order]
        seeds = _middles(starts, len(pixels))
        gutter, nearest = _gutter(pixels, size)
        return cls(size, pixels, triangles, shares, seeds.astype(np.int32), seed_of.astype(np.int32), gutter, nearest)

    def points(self, mesh: TriangleMesh, chosen: np.ndarray | slice = slice(None)) -> np.ndarray:
        """(N, 3) float64, where the chosen texels are on this position of the reference mesh, scene units."""
        return interpolated(mesh.vertices[mesh.triangles[self.triangles[chosen]]], self.shares[chosen])

    def image(self, values: np.ndarray) -> np.ndarray:
        """(size, size, ...) picture of (N, ...) values of the texels, with gutters: what no triangle covers takes the nearest texel."""
        result = np.zeros((self.size * self.size, *values.shape[1:]), values.dtype)
        result[self.pixels] = values
        result[self.gutter] = values[self.nearest]
        return result.reshape(self.size, self.size, *values.shape[1:])


def interpolated(corners: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """(N, D) values at points of triangles: (N, 3, D) at the corners, (N, 2) weights of the second and third."""
    first = corners[:, 0]
    return first + shares[:, :1] * (corners[:, 1] - first) + shares[:, 1:] * (corners[:, 2] - first)


def _blocks(pixels: np.ndarray, charts: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Order of the texels by chart and block, where each block begins in it, and the block of each texel in that order."""
    across = -(-size // STRIDE)
    row, column = np.divmod(pixels, size)
    key = (charts.astype(np.int64) * across + row // STRIDE) * across + column // STRIDE
    order = np.argsort(key, kind="stable")
    new = np.diff(key[order], prepend=-1) != 0
    return order, np.flatnonzero(new), np.cumsum(new) - 1


def _middles(starts: np.ndarray, count: int) -> np.ndarray:
    ends = np.append(starts[1:], count)
    return (starts + ends) // 2


def _gutter(pixels: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    texel = np.full(size * size, -1, np.int32)
    texel[pixels] = np.arange(len(pixels))
    empty = (texel < 0).reshape(size, size)
    gutter = np.flatnonzero(empty).astype(np.int32)
    if not len(pixels):
        return np.empty(0, np.int32), np.empty(0, np.int32)
    row, column = distance_transform_edt(empty, return_distances=False, return_indices=True)
    return gutter, texel[(row[empty] * size + column[empty])]
