"""Centers that are near each other, and those that stay so."""

from __future__ import annotations

from functools import reduce

import numpy as np
from scipy.spatial import cKDTree

NEAR = 1.75  # center spacings between neighbors; the affinity of two centers has fallen to one half there
PARTED = 3.0  # center spacings at which neighbors have parted


def neighbor_pairs(centers: np.ndarray, spacing: float) -> np.ndarray:
    """(N, 2) pairs of (C, 3) centers that are near each other. spacing : s, scene units."""
    return cKDTree(centers).query_pairs(NEAR * spacing, output_type="ndarray")


def lasting_pairs(positions: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """(N, 2) centers that are near each other at first and never part, and (N,) the farthest they get from each other.

    positions : (F, C, 3) scene units.  spacing : s, scene units.
    """
    pairs = neighbor_pairs(positions[0], spacing)
    farthest = reduce(np.maximum, (np.linalg.norm(centers[pairs[:, 0]] - centers[pairs[:, 1]], axis=1) for centers in positions))
    together = farthest < PARTED * spacing
    return pairs[together], farthest[together]
