"""The offset about which positions are stored in single precision, so that bodies far from the origin keep their shape."""

from __future__ import annotations

import numpy as np

# Distance from the origin, in diagonals of the body, beyond which single precision shows: it resolves 6e-8 of a coordinate there, so
# that up to here positions are within 1e-6 of the diagonal.
FAR = 8.0


def storage_offset(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(3,) float64 to be subtracted from positions before they are stored as float32; zeros near the origin.

    low, high : (3,) corners of the bounding box, scene units. Each number is a whole multiple of a power of ten about the size of the
    body, and one that single precision holds exactly, as objects in Blender have their place in it.
    """
    center, diagonal = (low + high) / 2, float(np.linalg.norm(high - low))
    if not diagonal > 0 or np.abs(center).max() <= FAR * diagonal:
        return np.zeros(3)
    step = 10.0 ** np.floor(np.log10(diagonal))
    return (np.rint(center / step) * step).astype(np.float32).astype(np.float64)
