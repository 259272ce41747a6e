"""Pictures of colored surfaces without light, and how far two of them differ."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from ..geometry.vectors import TINY
from ..types import FrozenArrays, TriangleMesh
from .appearance import LUMA, Appearance
from .raster import Fragments, rasterized
from .texels import interpolated

MARGIN = 0.02  # of the picture's side, free on all sides
SAMPLES = 2  # rows and columns of samples in a pixel: with one, each pixel of an outline is right or wrong as a whole
PEAK = 255.0
WINDOW = 1.5  # standard deviation of SSIM's window, pixels, and its two constants (Wang et al. 2004, section III.B)
TRUNCATE = 3.5  # standard deviations that the window reaches
C1, C2 = (0.01 * PEAK) ** 2, (0.03 * PEAK) ** 2


@dataclass(frozen=True)
class Camera:
    """An orthographic camera with a square picture.

    turn : world to view; x right, y up, z toward the camera.  center : (3,) scene units.  scale : pixels per scene unit.
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
    """colors : (H, W, 3), 0 to 255, black where nothing is.  covered : (H, W), share of each pixel that shows the surface."""

    colors: np.ndarray
    covered: np.ndarray


@dataclass(frozen=True)
class PictureError:
    """Over the pixels that both surfaces cover wholly, so without their outlines.  psnr : decibel.  ssim : mean structural similarity of
    luma.  picture_psnr, picture_ssim : over the whole pictures, outlines and black background included.
    """

    psnr: float
    ssim: float
    picture_psnr: float
    picture_ssim: float


def eight_views() -> list[Rotation]:
    """Cameras on the corners of a cube: no axis of the scene counts as up."""
    return [Rotation.align_vectors([[0.0, 0.0, 1.0]], [corner])[0] for corner in product((-1.0, 1.0), repeat=3)]


def rendered(appearance: Appearance, camera: Camera) -> Picture:
    """The surface as the camera sees it, one sample in the middle of each pixel; the nearest triangle, whichever way it faces."""
    places, nearness = camera.projected(appearance.mesh.vertices)
    triangles = appearance.mesh.triangles
    seen = rasterized(places[triangles], camera.size, camera.size)
    front = _front(seen, interpolated(nearness[triangles][seen.triangles][..., None], seen.shares)[:, 0], camera.size)
    colors = np.zeros((camera.size**2, 3), np.uint8)
    shown = front[front >= 0]
    colors[front >= 0] = np.rint(appearance.at(seen.triangles[shown], seen.shares[shown]))
    return Picture(colors.reshape(camera.size, camera.size, 3), (front >= 0).reshape(camera.size, camera.size))


def _front(seen: Fragments, nearness: np.ndarray, size: int) -> np.ndarray:
    """(size * size,) the nearest fragment of each pixel, of equal ones that of the last triangle; -1 where there is none."""
    front, fragments = np.full(size * size, -1), np.arange(len(seen.pixels))
    while len(fragments):  # as often as surfaces lie behind each other
        front[seen.pixels[fragments]] = fragments  # of several values for a pixel, the last one stays
        rival = front[seen.pixels[fragments]]
        nearer = nearness[fragments] > nearness[rival]
        fragments = fragments[nearer]
    return front


def antialiased(appearance: Appearance, camera: Camera) -> Picture:
    """As `rendered`, each pixel the mean of SAMPLES by SAMPLES samples; float32."""
    fine = rendered(appearance, replace(camera, size=camera.size * SAMPLES, scale=camera.scale * SAMPLES))
    return Picture(_means(fine.colors), _means(fine.covered[:, :, None])[:, :, 0])


def _means(samples: np.ndarray) -> np.ndarray:
    """(H, W, D) float32, means of SAMPLES by SAMPLES pixels."""
    places = product(range(SAMPLES), repeat=2)
    total = sum(samples[row::SAMPLES, column::SAMPLES].astype(np.uint16) for row, column in places)
    return np.asarray(total, np.float32) / SAMPLES**2


def picture_error(source: Appearance, result: Appearance, size: int, views: list[Rotation]) -> PictureError:
    """How far antialiased pictures of the result are from those of the source, all views together. Infinite PSNR where they are equal."""
    sums = np.zeros((2, 3))
    for turn in views:
        camera = Camera.around(source.mesh, size, turn)
        one, other = antialiased(source, camera), antialiased(result, camera)
        box = _box((one.covered > 0) | (other.covered > 0))
        square = ((one.colors[box] - other.colors[box]) ** 2).mean(axis=2, dtype=np.float64)
        similar = similarity(one.colors[box] @ LUMA, other.colors[box] @ LUMA)
        both = (one.covered[box] == 1) & (other.covered[box] == 1)
        sums[0] += [square[both].sum(), similar[both].sum(), both.sum()]
        sums[1] += [square.sum(), similar.sum() + size * size - similar.size, size * size]  # beyond the box both are black
    squares, similar = sums[:, :2].T / np.maximum(sums[:, 2], 1)
    return PictureError(_decibel(squares[0]), float(similar[0]), _decibel(squares[1]), float(similar[1]))


def _box(covered: np.ndarray) -> tuple[slice, slice]:
    """Rows and columns with anything covered, and as far around them as SSIM's window reaches."""
    reach = int(TRUNCATE * WINDOW + 0.5)
    spans = [np.flatnonzero(covered.any(axis=axis)) for axis in (1, 0)]
    rows, columns = (slice(max(span[0] - reach, 0), span[-1] + reach + 1) if len(span) else slice(0, 0) for span in spans)
    return rows, columns


def similarity(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(H, W) structural similarity of two pictures of one channel, 0 to 255 (Wang et al., "Image quality assessment", TIP 2004)."""
    blur = lambda picture: gaussian_filter(picture, WINDOW, truncate=TRUNCATE)
    a, b = blur(one), blur(other)
    aa, bb, ab = blur(one * one) - a * a, blur(other * other) - b * b, blur(one * other) - a * b
    return (2 * a * b + C1) * (2 * ab + C2) / ((a * a + b * b + C1) * (aa + bb + C2))


def _decibel(mean_square: float) -> float:
    return float(10 * np.log10(PEAK**2 / mean_square)) if mean_square > 0 else float("inf")
