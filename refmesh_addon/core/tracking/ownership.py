"""Which center each sample of a volume belongs to: the nearest one, kept up to date while the centers move.

As long as a sample is nearer to its owner than to any other center, its owner is the same. Both distances are bounded by how far
the centers have moved since the last query (Hamerly 2010, "Making k-means even faster"); that any other center has come nearer
is bounded by the motion of the neighbors of the owner, beyond which no center can be the next. So only samples near the
boundaries of cells are queried again, hardly any once the centers settle. The result is that of querying all of them.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.vectors import row_dot
from .volume import VolumeSamples

ROUNDING = 1e-12  # share of a distance by which bounds are widened, so that rounding cannot hide a change
NEIGHBORS = 24  # centers around each, whose motion is followed: their two shells, nearly
OUTDATED = 0.25  # displacement since neighbors were last listed, in their mean distance, at which they are listed anew


class Ownership:
    """The nearest of C centers for each of N samples."""

    def __init__(self, samples: VolumeSamples):
        self.samples = samples
        self._centers: np.ndarray | None = None
        self._owners = np.zeros(len(samples.positions), dtype=np.intp)
        self._near = np.zeros(len(samples.positions))  # upper bounds of the distance to the owner
        self._next = np.zeros(len(samples.positions))  # lower bounds of the distance to any other center

    def of(self, centers: np.ndarray) -> np.ndarray:
        """(N,) index of the nearest of (C, 3) centers, C the same in every call; not to be changed by the caller."""
        if self._centers is None:
            self._neighborhoods = _Neighborhoods(centers)
            self._query(slice(None), centers)
        else:
            self._move(centers)
            doubtful = np.flatnonzero(self._near * (1 + 2 * ROUNDING) >= self._next)
            self._near[doubtful] = self._distances(doubtful, centers)
            doubtful = doubtful[self._near[doubtful] * (1 + ROUNDING) >= self._next[doubtful]]
            if len(doubtful):
                self._query(doubtful, centers)
        self._centers = centers
        return self._owners

    def distances(self, centers: np.ndarray) -> np.ndarray:
        """(N,) distance of each sample from the owner of its last query."""
        return self._distances(slice(None), centers)

    def _distances(self, chosen: slice | np.ndarray, centers: np.ndarray) -> np.ndarray:
        offsets = self.samples.positions[chosen] - centers[self._owners[chosen]]
        return np.sqrt(row_dot(offsets, offsets))

    def _move(self, centers: np.ndarray) -> None:
        """Brings the bounds up to date with centers that have moved."""
        steps = np.sqrt(((centers - self._centers) ** 2).sum(axis=1))
        approach, beyond = self._neighborhoods.bounds(steps, centers)
        self._near += steps[self._owners]
        np.minimum(self._next - approach[self._owners], beyond[self._owners] - self._near, out=self._next)

    def _query(self, chosen: slice | np.ndarray, centers: np.ndarray) -> None:
        if len(centers) == 1:
            self._next[:] = np.inf
            return
        distance, nearest = cKDTree(centers).query(self.samples.positions[chosen], k=2, workers=-1)
        self._owners[chosen] = nearest[:, 0]
        self._near[chosen] = distance[:, 0]
        self._next[chosen] = distance[:, 1] * (1 - ROUNDING)


class _Neighborhoods:
    """The NEIGHBORS nearest centers of each center, and how far all others are at least."""

    def __init__(self, centers: np.ndarray):
        self._list(centers)

    def _list(self, centers: np.ndarray) -> None:
        distance, self._neighbors = cKDTree(centers).query(centers, k=range(1, min(NEIGHBORS, len(centers) - 1) + 2))
        self._centers = centers
        self._radius = distance[:, -1] if len(centers) > NEIGHBORS + 1 else np.full(len(centers), np.inf)
        self._outdated = OUTDATED * distance[:, 1:].mean() if len(centers) > 1 else np.inf

    def bounds(self, steps: np.ndarray, centers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(C,) largest step among the neighbors of each center, and (C,) least distance of any center beyond them.

        steps : (C,) the last ones.  centers : (C, 3) where they led.
        """
        displaced = np.sqrt(((centers - self._centers) ** 2).sum(axis=1))
        approach = steps[self._neighbors].max(axis=1)
        beyond = (self._radius - displaced - displaced.max()) * (1 - ROUNDING)
        if displaced.max() > self._outdated:
            self._list(centers)
        return approach, beyond
