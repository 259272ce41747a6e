"""Pictures of colored surfaces without light, and how far two of them differ."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from ..geometry.vectors import TINY
from ..types import FrozenArrays, TriangleMesh
from .appearance import Appearance
from .raster import rasterized

MARGIN = 0.02  # of the picture's side, free on all sides
PEAK = 255.0
WINDOW = 1.5  # standard deviation of SSIM's window, pixels, and its two constants (Wang et al. 2004, section III.B)
C1, C2 = (0.01 * PEAK) ** 2, (0.03 * PEAK) ** 2
LUMA = np.array([0.299, 0.587, 0.114])  # ITU-R BT.601


@dataclass(frozen=True)
class Camera:
    """An orthographic camera with a square picture.

    turn : world to view; x right, y up, z towards the camera.  center : (3,) scene units.  scale : pixels per scene unit.
    """

    turn: Rotation
    center: np.ndarray
    scale: float
    size: int

    @classmethod
    def around(cls, mesh: TriangleMesh, size: int, turn: Rotation) -> Camera:
        """The whole mesh fits into the square picture, whichever way the camera turns."""
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        return cls(turn, (low + high) / 2, size * (1 - 2 * MARGIN) / max(mesh.diagonal, float(TINY)), size)

    def projected(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 2) pixels, x from the left and y from the top, and (N,) nearness, scene units, of (N, 3) points."""
        x, y, z = self.turn.apply(points - self.center).T
        return np.column_stack([x, -y]) * self.scale + self.size / 2, z


@dataclass(frozen=True)
class Picture(FrozenArrays):
    """colors : (H, W, 3) uint8, black where nothing is.  covered : (H, W) bool."""

    colors: np.ndarray
    covered: np.ndarray


@dataclass(frozen=True)
class PictureError:
    """Over the pixels that both surfaces cover, so without their outlines.  psnr : decibel.  ssim : mean structural similarity of luma.
    picture_psnr, picture_ssim : over the whole pictures, outlines and black background included.
    """

    psnr: float
    ssim: float
    picture_psnr: float
    picture_ssim: float


def eight_views() -> list[Rotation]:
    """Cameras on the corners of a cube: no axis of the scene counts as up."""
    return [Rotation.align_vectors([[0.0, 0.0, 1.0]], [corner])[0] for corner in product((-1.0, 1.0), repeat=3)]


def rendered(appearance: Appearance, camera: Camera) -> Picture:
    """The surface as the camera sees it; the nearest of all triangles in each pixel, whichever way it faces."""
    places, nearness = camera.projected(appearance.mesh.vertices)
    triangles = appearance.mesh.triangles
    seen = rasterized(places[triangles], camera.size, camera.size)
    depth = nearness[triangles][seen.triangles]
    depth = depth[:, 0] + seen.shares[:, 0] * (depth[:, 1] - depth[:, 0]) + seen.shares[:, 1] * (depth[:, 2] - depth[:, 0])
    order = np.lexsort([seen.triangles, depth, seen.pixels])
    last = order[np.append(np.diff(seen.pixels[order]) != 0, True)] if len(order) else order
    colors = np.zeros((camera.size**2, 3), np.uint8)
    colors[seen.pixels[last]] = np.rint(appearance.at(seen.triangles[last], seen.shares[last]))
    covered = np.zeros(camera.size**2, bool)
    covered[seen.pixels[last]] = True
    return Picture(colors.reshape(camera.size, camera.size, 3), covered.reshape(camera.size, camera.size))


def picture_error(source: Appearance, result: Appearance, size: int, views: list[Rotation]) -> PictureError:
    """How far pictures of the result are from those of the source, all views together. Infinite PSNR where they are equal."""
    sums = np.zeros((2, 3))
    for turn in views:
        camera = Camera.around(source.mesh, size, turn)
        one, other = rendered(source, camera), rendered(result, camera)
        square = ((one.colors.astype(np.float64) - other.colors) ** 2).mean(axis=2)
        similar = similarity(one.colors @ LUMA, other.colors @ LUMA)
        for row, shown in enumerate((one.covered & other.covered, np.ones_like(one.covered))):
            sums[row] += [square[shown].sum(), similar[shown].sum(), shown.sum()]
    squares, similar = sums[:, :2].T / np.maximum(sums[:, 2], 1)
    return PictureError(_decibel(squares[0]), float(similar[0]), _decibel(squares[1]), float(similar[1]))


def similarity(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(H, W) structural similarity of two pictures of one channel, 0 to 255 (Wang et al., "Image quality assessment", TIP 2004)."""
    blur = lambda picture: gaussian_filter(picture, WINDOW, truncate=3.5)
    a, b = blur(one), blur(other)
    aa, bb, ab = blur(one * one) - a * a, blur(other * other) - b * b, blur(one * other) - a * b
    return (2 * a * b + C1) * (2 * ab + C2) / ((a * a + b * b + C1) * (aa + bb + C2))


def _decibel(mean_square: float) -> float:
    return float(10 * np.log10(PEAK**2 / mean_square)) if mean_square > 0 else float("inf")
