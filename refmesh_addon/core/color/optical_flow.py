"""Dense optical flow between two pictures: Lucas-Kanade, iterated from coarse to fine.

Lucas and Kanade, "An iterative image registration technique", IJCAI 1981; with the images' own resolution halved per level as in
Bouguet, "Pyramidal implementation of the Lucas Kanade feature tracker", 2000. Pixels outside a mask neither count nor spread.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from ..types import FrozenArrays

WINDOW = 3.0  # standard deviation of the window, pixels of each level
ROUNDS = 4  # per level at most; further ones move by less than a tenth of a pixel
SETTLED = 0.05  # pixels that textured places move by in the mean, below which a level is done
SMALLEST = 32  # pixels along a side of the coarsest level
LONGEST_STEP = 2.0  # pixels in a round: beyond, the linear model does not hold
STRUCTURE = 4.0  # smallest eigenvalue of the structure tensor, squared gray levels per pixel, above which a place has texture
AGREEMENT = 0.5  # pixels between forward flow and backward flow, below which both are trusted


@dataclass(frozen=True)
class Flow(FrozenArrays):
    """offsets : (H, W, 2) float32 pixels, x to the right and y down: what is at p in the first picture is at p + offset in the second.
    trusted : (H, W) bool, where the picture has structure and the flow back agrees.
    """

    offsets: np.ndarray
    trusted: np.ndarray


def flow_between(first: np.ndarray, second: np.ndarray, mask: np.ndarray) -> Flow:
    """Flow between two (H, W) float32 pictures, 0 to 255, inside an (H, W) bool mask; both ways, to tell what can be trusted."""
    forward, structure = _flow(first, second, mask)
    backward, _ = _flow(second, first, mask)
    y, x = np.indices(first.shape, dtype=np.float32)
    returned = np.stack([_sampled(backward[..., axis], x + forward[..., 0], y + forward[..., 1]) for axis in (0, 1)], axis=-1)
    agreeing = np.linalg.norm(forward + returned, axis=-1) < AGREEMENT
    return Flow(forward, mask & agreeing & (structure > STRUCTURE))


def _flow(first: np.ndarray, second: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (H, W, 2) and the smallest eigenvalue (H, W) of the structure tensor at full resolution."""
    levels = [(first, second, mask.astype(np.float32))]
    while min(levels[-1][0].shape) >= 2 * SMALLEST:  # halves
        levels.append(_halved(*levels[-1]))
    offsets = np.zeros((*levels[-1][0].shape, 2), np.float32)
    structure = np.zeros(first.shape, np.float32)
    for one, other, weight in reversed(levels):
        if offsets.shape[:2] != one.shape:
            offsets = 2.0 * np.stack([_doubled(offsets[..., axis], one.shape) for axis in (0, 1)], axis=-1)
        offsets, structure = _refined(one, other, weight, offsets)
    return offsets, structure


def _refined(first: np.ndarray, second: np.ndarray, weight: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Offsets after ROUNDS of Lucas-Kanade on one level, and the smallest eigenvalue of the structure tensor."""
    blur = lambda image: gaussian_filter(image, WINDOW, truncate=2.5)
    slope_y, slope_x = np.gradient(first)
    inner = weight * (blur(weight) > 0.5)  # gradients across the border of a chart are not the picture's
    total = np.maximum(blur(inner), 1e-3)
    xx, xy, yy = (blur(inner * product) / total for product in (slope_x * slope_x, slope_x * slope_y, slope_y * slope_y))
    structure = 0.5 * (xx + yy) - np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    steady_xx, steady_yy = xx + 0.25 * STRUCTURE, yy + 0.25 * STRUCTURE  # flat places stay where the level above put them
    determinant = steady_xx * steady_yy - xy * xy
    textured = (inner > 0) & (structure > STRUCTURE)
    y, x = np.indices(first.shape, dtype=np.float32)
    for _ in range(ROUNDS):
        at = x + offsets[..., 0], y + offsets[..., 1]
        valid = inner * _sampled(inner, *at)
        change = first - _sampled(second, *at)
        share = np.maximum(blur(valid), 1e-3)
        right, down = (blur(valid * slope * change) / share for slope in (slope_x, slope_y))
        step = np.stack([steady_yy * right - xy * down, steady_xx * down - xy * right], axis=-1) / determinant[..., None]
        offsets = offsets + np.clip(step, -LONGEST_STEP, LONGEST_STEP)
        if not textured.any() or np.abs(step[textured]).mean() < SETTLED:
            break
    return offsets.astype(np.float32), structure


def _halved(first: np.ndarray, second: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means of two by two pixels, over those inside the mask."""
    quarters = lambda image: image[: image.shape[0] // 2 * 2, : image.shape[1] // 2 * 2].reshape(
        image.shape[0] // 2, 2, image.shape[1] // 2, 2
    )
    total = quarters(weight).mean(axis=(1, 3))
    mean = lambda image: quarters(image * weight).mean(axis=(1, 3)) / np.maximum(total, 1e-6)
    return mean(first), mean(second), (total > 0.5).astype(np.float32)


def _doubled(image: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    y, x = np.indices(shape, dtype=np.float32)
    return _sampled(image, (x - 0.5) / 2, (y - 0.5) / 2)


def _sampled(image: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return map_coordinates(image, [y, x], order=1, mode="nearest", output=np.float32)
