"""Cubic Hermite interpolation."""

from __future__ import annotations

import numpy as np


def hermite(
    ends: tuple[np.ndarray, np.ndarray], tangents: tuple[np.ndarray, np.ndarray], share: float
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and derivatives at a share of the way from one end to the other.

    ends, tangents : (..., 3) positions, and derivatives by the share, at both ends.  share : 0 to 1.

    >>> hermite((np.zeros(3), np.ones(3)), (np.ones(3), np.ones(3)), 0.25)[0]
    array([0.25, 0.25, 0.25])
    """
    t, (start, end), (out, into) = share, ends, tangents
    positions = (1 + 2 * t) * (1 - t) ** 2 * start + t * (1 - t) ** 2 * out + t**2 * (3 - 2 * t) * end + t**2 * (t - 1) * into
    derivatives = 6 * t * (t - 1) * (start - end) + (1 - t) * (1 - 3 * t) * out + t * (3 * t - 2) * into
    return positions, derivatives
