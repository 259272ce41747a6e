"""What colors the surface of one captured frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..types import FrozenArrays, TriangleMesh
from .texels import interpolated

WHITE = np.full((1, 1, 3), 255, np.uint8)
LUMA = np.array([0.299, 0.587, 0.114])  # of red, green and blue, ITU-R BT.601


@dataclass(frozen=True)
class Appearance(FrozenArrays):
    """A frame's triangles as in its file, with seams, and their colors: images where there are any, else colors at the corners.

    uvs : (T, 3, 2) float32, place of each corner in its image, v up, repeated beyond 0 to 1; zeros without images.
    materials : (T,) int32, index into `images`; -1 where a triangle has no image.
    colors : (T, 3, 3) uint8, of the corners; counts where there is no image.
    images : each (H, W, 3) uint8, first row at the top.
    """

    mesh: TriangleMesh
    uvs: np.ndarray
    materials: np.ndarray
    colors: np.ndarray
    images: tuple[np.ndarray, ...] = ()

    def __post_init__(self):
        count = len(self.mesh.triangles)
        for name, shape in (("uvs", (count, 3, 2)), ("materials", (count,)), ("colors", (count, 3, 3))):
            if getattr(self, name).shape != shape:
                raise ValueError(f"{name} must be {shape}; got {getattr(self, name).shape}")
        if self.materials.size and not -1 <= self.materials.min() <= self.materials.max() < len(self.images):
            raise ValueError(f"materials must be -1 to {len(self.images) - 1}")
        super().__post_init__()

    @property
    def size(self) -> int:
        """Longest side of its images, pixels; 0 without images."""
        return max((max(image.shape[:2]) for image in self.images), default=0)

    def reoriented(self, flipped: np.ndarray) -> Appearance:
        """The same colors with the triangles marked in (T,) `flipped` turned over."""
        turned = lambda corners: np.where(flipped.reshape(-1, *[1] * (corners.ndim - 1)), corners[:, ::-1], corners)
        mesh = TriangleMesh(self.mesh.vertices, turned(self.mesh.triangles))
        return Appearance(mesh, turned(self.uvs), self.materials, turned(self.colors), self.images)

    def at(self, triangles: np.ndarray, shares: np.ndarray) -> np.ndarray:
        """(N, 3) float32 colors, 0 to 255, at points of (N,) triangles with (N, 2) weights of their second and third corner."""
        result = np.empty((len(triangles), 3), np.float32)
        owner = self.materials[triangles]
        for material in range(-1, len(self.images)):
            own = slice(None) if (owner == material).all() else np.flatnonzero(owner == material)
            chosen, weights = triangles[own], shares[own]
            if not len(chosen):
                continue
            if material < 0:
                result[own] = interpolated(self.colors[chosen].astype(np.float32), weights)
            else:
                result[own] = sampled(self.images[material], interpolated(self.uvs[chosen], weights))
        return result


def sampled(image: np.ndarray, uvs: np.ndarray) -> np.ndarray:
    """(N, 3) float32, the (H, W, 3) uint8 image at (N, 2) places, bilinear; what lies beyond its borders repeats it."""
    height, width = image.shape[:2]
    x = np.mod(uvs[:, 0], 1.0) * width - 0.5
    y = np.mod(1.0 - uvs[:, 1], 1.0) * height - 0.5
    column, row = np.floor(x).astype(np.int32), np.floor(y).astype(np.int32)
    right, below = (x - column)[:, None].astype(np.float32), (y - row)[:, None].astype(np.float32)
    columns, rows = (column % width, (column + 1) % width), (row % height * width, (row + 1) % height * width)
    flat = image.reshape(-1, 3)
    upper = _mixed(flat, rows[0], columns, right)
    return upper + below * (_mixed(flat, rows[1], columns, right) - upper)


def _mixed(flat: np.ndarray, row: np.ndarray, columns: tuple[np.ndarray, np.ndarray], right: np.ndarray) -> np.ndarray:
    left = flat.take(row + columns[0], axis=0).astype(np.float32)
    return left + right * (flat.take(row + columns[1], axis=0) - left)
