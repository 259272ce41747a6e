"""One texture for all frames of a group: the median of the frames that see a texel, and the sharpest frame where the median blurs."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from .appearance import LUMA
from .texels import Texels

NEIGHBORHOOD = 1 / 128  # of the texture's side, standard deviation within which sharpness is compared
BLURRED, SHARP = 0.5, 0.9  # detail of the median as a share of the frames' own: below, the sharpest frame shows; above, the median does
PREFERENCE = 1.25  # of the frame that is sharpest on the whole: another must be sharper by this to take its place, or views get mixed
NOISE = 2.0  # gray levels, detail that noise alone has
BLOCK = 1 << 17  # texels whose median is taken at once


def steady_texture(texels: Texels, colors: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) uint8 color of each texel and (N,) bool whether any frame sees it.

    colors : (F, N, 3) uint8 of F frames, exposures evened.  seen : (F, N) bool. What no frame sees takes the median of all.
    """
    median = median_seen(colors, seen)
    detail = np.stack([_detail(texels, frame) for frame in colors])
    typical = np.median(detail, axis=0)
    detail[detail.sum(axis=1).argmax()] *= PREFERENCE
    sharpest = np.where(seen, detail, -1.0).argmax(axis=0)
    view = np.take_along_axis(colors, sharpest[None, :, None], axis=0)[0]
    kept = np.clip((_detail(texels, median) / np.maximum(typical, NOISE) - BLURRED) / (SHARP - BLURRED), 0.0, 1.0)
    kept = np.where(typical > NOISE, kept, 1.0)[:, None]
    return np.rint(kept * median + (1.0 - kept) * view).astype(np.uint8), seen.any(axis=0)


def median_seen(colors: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(N, 3) uint8 median over the frames that see a texel; over all frames where none does."""
    result = np.empty(colors.shape[1:], np.uint8)
    for at in range(0, len(result), BLOCK):
        block = slice(at, at + BLOCK)
        counted = seen[:, block] | ~seen[:, block].any(axis=0)
        values = np.where(counted[:, :, None], colors[:, block], np.uint8(255))  # what is not seen sorts to the end
        values.sort(axis=0)
        middle = (counted.sum(axis=0) - 1) // 2
        result[block] = np.take_along_axis(values, middle[None, :, None], axis=0)[0]
    return result


def filled(colors: np.ndarray, seen: np.ndarray, steady: np.ndarray, steady_seen: np.ndarray) -> np.ndarray:
    """One frame's (N, 3) colors with unseen texels taken from the steady texture where another frame sees them."""
    return np.where((~seen & steady_seen)[:, None], steady, colors)


def _detail(texels: Texels, colors: np.ndarray) -> np.ndarray:
    """(N,) root mean square of the luma's gradient around each texel, gray levels per texel."""
    luma = texels.image(colors @ LUMA.astype(np.float32))
    energy = sum(np.gradient(luma, axis=axis) ** 2 for axis in (0, 1))
    covered = np.zeros(luma.size, np.float32)
    covered[texels.pixels] = 1.0
    energy = np.where(covered.reshape(luma.shape) > 0, energy, 0.0)
    blur = lambda image: gaussian_filter(image, NEIGHBORHOOD * texels.size, mode="constant", truncate=2.0).ravel()[texels.pixels]
    return np.sqrt(blur(energy) / np.maximum(blur(covered.reshape(luma.shape)), 1e-6))
