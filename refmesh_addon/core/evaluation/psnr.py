"""Geometry PSNR of point clouds, D1 (point-to-point) and D2 (point-to-plane), as MPEG's point-cloud metrics define them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.vectors import row_dot
from .sampled_surface import SampledSurface

PSNR_CEILING = 999.99  # dB, stands for "no difference": JSON has no infinity


def d1_d2_psnr(first: SampledSurface, second: SampledSurface, peak: float) -> tuple[float, float]:
    """D1 and D2 in dB.

    peak : scene units, here the bounding-box diagonal. PSNR = 10 log10(peak^2 / MSE) with the larger of the two directions'
    mean squared errors. MPEG writes 3 p^2 for peak^2 with p the longest side of the box: the same for a cube, at most 4.8 dB more
    for any other box.

    D1 has a floor: clouds sampled from one surface lie about half a sample spacing apart. PSNR_CEILING where nothing differs.
    """
    errors = np.array([_mean_squares(first, second), _mean_squares(second, first)])
    point, plane = errors.max(axis=0)
    return _psnr(point, peak), _psnr(plane, peak)


def _mean_squares(cloud: SampledSurface, reference: SampledSurface) -> tuple[float, float]:
    """Mean squared distances of the cloud's points from the nearest reference points and from the planes through these."""
    nearest = cKDTree(reference.points).query(cloud.points, workers=-1)[1]
    difference = cloud.points - reference.points[nearest]
    along_normal = row_dot(difference, reference.normals[nearest])
    return row_dot(difference, difference).mean(), (along_normal**2).mean()


def _psnr(mean_square: float, peak: float) -> float:
    if mean_square <= 0:
        return PSNR_CEILING
    return float(min(10.0 * np.log10(peak**2 / mean_square), PSNR_CEILING))
