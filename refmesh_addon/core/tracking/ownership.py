"""Which center each sample of a volume belongs to: the nearest one, kept up to date while the centers move.

When no center has moved further than half the gap between a sample's nearest and second nearest center, its owner is
still the same (Hamerly 2010, "Making k-means even faster"). So only samples near the boundaries of cells are queried again,
hardly any once the centers settle. The result is that of querying all of them.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.vectors import row_dot
from .volume import VolumeSamples

ROUNDING = 1e-12  # share of a distance by which bounds are widened, so that rounding cannot hide a change


class Ownership:
    """The nearest of C centers for each of N samples."""

    def __init__(self, samples: VolumeSamples):
        self.samples = samples
        self._centers: np.ndarray | None = None
        self._owners = np.zeros(len(samples.positions), dtype=np.intp)
        self._gaps = np.zeros(len(samples.positions))  # lower bounds of the distance to any center but the owner

    def of(self, centers: np.ndarray) -> np.ndarray:
        """(N,) index of the nearest of (C, 3) centers, C the same in every call; not to be changed by the caller."""
        if self._centers is None:
            self._query(slice(None), centers)
        else:
            furthest = np.sqrt(((centers - self._centers) ** 2).sum(axis=1).max())
            self._gaps -= furthest
            doubtful = np.flatnonzero(self.distances(centers) * (1 + ROUNDING) >= self._gaps)
            if len(doubtful):
                self._query(doubtful, centers)
        self._centers = centers
        return self._owners

    def distances(self, centers: np.ndarray) -> np.ndarray:
        """(N,) distance of each sample from the owner of its last query."""
        offsets = self.samples.positions - centers[self._owners]
        return np.sqrt(row_dot(offsets, offsets))

    def _query(self, chosen: slice | np.ndarray, centers: np.ndarray) -> None:
        if len(centers) == 1:
            self._gaps[:] = np.inf
            return
        distance, nearest = cKDTree(centers).query(self.samples.positions[chosen], k=2, workers=-1)
        self._owners[chosen] = nearest[:, 0]
        self._gaps[chosen] = distance[:, 1] * (1 - ROUNDING)
