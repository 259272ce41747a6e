"""A UV map of the artist's own as the texture layout of the mesh that it belongs to."""

from __future__ import annotations

import numpy as np

from .layout import Layout
from .raster import rasterized

ROUNDING = 1e-4  # beyond the square from 0 to 1, which counts as inside
MOST_SHARED = 0.05  # share of the covered texels that several triangles may cover, each of which shows the colors of one only
CHECKED_SIZE = 512  # texels along a side at which that is counted


def layout_of(corners: np.ndarray) -> Layout:
    """The layout of a UV map given by the corners of the triangles, (T, 3, 2), v up. Equal places of neighbors become one.

    Raises ValueError, saying why, for a map that cannot hold the colors of a whole surface.
    """
    if not np.isfinite(corners).all():
        raise ValueError("it has coordinates that are not finite numbers")
    if corners.min() < -ROUNDING or corners.max() > 1 + ROUNDING:
        raise ValueError(f"it reaches from {corners.min():.3g} to {corners.max():.3g}, beyond the square from 0 to 1")
    uvs, place = np.unique(np.clip(corners.reshape(-1, 2).astype(np.float64), 0.0, 1.0), axis=0, return_inverse=True)
    layout = Layout(uvs, place.reshape(-1, 3).astype(np.int32))
    pixels = rasterized(layout.pixels(CHECKED_SIZE), CHECKED_SIZE, CHECKED_SIZE).pixels
    if not len(pixels):
        raise ValueError("it covers nothing")
    shared = 1 - len(np.unique(pixels)) / len(pixels)
    if shared > MOST_SHARED:
        raise ValueError(f"{shared:.0%} of it overlaps, where faces would show the colors of others")
    return layout
