"""The texels of a layout, worked out once for all frames that share it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.ndimage import correlate1d, distance_transform_edt, maximum_filter

from ..types import FrozenArrays, TriangleMesh
from .layout import Layout
from .raster import Fragments, rasterized, shares_at

STRIDE = 4  # texels along the side of a block, of which one is looked up exactly; fewer miss less and take longer
# Linear interpolation between texels spreads each by a sixth of a square texel along either axis, in the mean over all places in between.
# Taking a twelfth of every neighbor would undo that for slow changes and overdo it for edges; between a twentieth and a tenth all is alike.
SHARPENING = 1 / 16
FARTHEST = 2.0  # heights of a triangle that a texel beside it may lie outside: smaller triangles say too little about its plane


@dataclass(frozen=True)
class Texels(FrozenArrays):
    """The texels of a square texture that triangles cover, and those beside them, block by block, so that neighbors in the picture are
    neighbors in memory. One beside a chart lies in the plane of a triangle, beyond its edge: interpolation at seams takes it in.

    size : texels along a side.  pixels : (N,) int32, row * size + column, rows from the top.
    triangles : (N,) int32, of the reference mesh.  shares : (N, 2) float32, weights of the triangle's second and third corner.
    seeds : (M,) int32, one texel of each block and chart.  seed_of : (N,) int32, index into `seeds`.
    gutter : (G,) int32 all other pixels.  nearest : (G,) int32, the texel next to each.
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
        covered = Fragments(*(getattr(fragments, name)[first] for name in ("pixels", "triangles", "shares")))
        rim = _rim(covered, layout.pixels(size), size)
        pixels, triangles, shares = (
            np.concatenate([getattr(part, name) for part in (covered, rim)]) for name in ("pixels", "triangles", "shares")
        )
        order, starts, seed_of = _blocks(pixels, layout.charts()[triangles], size)
        pixels, triangles, shares = pixels[order], triangles[order], shares[order]
        seeds = _middles(starts, len(pixels))
        gutter, nearest = _gutter(pixels, size)
        return cls(size, pixels, triangles, shares, seeds.astype(np.int32), seed_of.astype(np.int32), gutter, nearest)

    def points(self, mesh: TriangleMesh, chosen: np.ndarray | slice = slice(None)) -> np.ndarray:
        """(N, 3) float64, where the chosen texels are on this position of the reference mesh, scene units."""
        return interpolated(mesh.vertices[mesh.triangles[self.triangles[chosen]]], self.shares[chosen])

    def sharpened(self, values: np.ndarray) -> np.ndarray:
        """(N, D) float32 values that, interpolated between texels, show the given (N, D) ones where these are."""
        image = self.image(values.astype(np.float32))
        for axis in (0, 1):
            kernel = np.array([-SHARPENING, 1 + 2 * SHARPENING, -SHARPENING])
            image = correlate1d(image, kernel, axis=axis, mode="nearest")
        return image.reshape(self.size * self.size, -1)[self.pixels]

    def image(self, values: np.ndarray) -> np.ndarray:
        """(size, size, ...) picture of (N, ...) values of the texels, with gutters: all other pixels take the nearest texel."""
        result = np.zeros((self.size * self.size, *values.shape[1:]), values.dtype)
        result[self.pixels] = values
        result[self.gutter] = values[self.nearest]
        return result.reshape(self.size, self.size, *values.shape[1:])


def _rim(covered: Fragments, corners: np.ndarray, size: int) -> Fragments:
    """The pixels beside covered ones, each in the plane of the neighbors' triangle that it is the least outside of."""
    owner = np.full((size + 2, size + 2), -1, np.int32)  # a border around the picture has no owner
    inner = np.full(size * size, -1, np.int32)
    inner[covered.pixels] = covered.triangles
    owner[1:-1, 1:-1] = inner.reshape(size, size)
    row, column = np.nonzero((owner < 0) & maximum_filter(owner >= 0, size=3))
    inside = (row > 0) & (row <= size) & (column > 0) & (column <= size)
    row, column = row[inside], column[inside]
    triangles, shares, best = np.full(len(row), -1, np.int32), np.zeros((len(row), 2), np.float32), np.full(len(row), -FARTHEST)
    for down, right in product((-1, 0, 1), repeat=2):
        other = owner[row + down, column + right]
        at = np.flatnonzero(other >= 0)
        second, third = shares_at(corners, other[at], column[at] - 0.5, row[at] - 0.5)
        least = np.minimum(np.minimum(second, third), 1.0 - second - third)
        better = least > best[at]
        chosen = at[better]
        best[chosen], triangles[chosen] = least[better], other[chosen]
        shares[chosen] = np.stack([second, third], axis=1)[better]
    known = triangles >= 0
    return Fragments(((row - 1) * size + column - 1)[known].astype(np.int32), triangles[known], shares[known])


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
