"""Lloyd's relaxation: centers spread evenly through a volume."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy import sparse

from ..types import FrozenArrays
from .bisection import equal_parts
from .ownership import Ownership
from .volume import Volume, VolumeSamples

OVER_RELAXATION = 1.8  # published: a step goes this many times the way to the centroid, which settles sooner
MAX_STEPS = 100  # published number of steps for the first spread, on each level
SETTLED = 1e-3  # largest step, in s, at which the first spread has settled


@dataclass(frozen=True)
class Cells(FrozenArrays):
    """The share of the volume nearest to each center.

    masses : (C,) voxels.  centroids : (C, 3).  second : (C, 3, 3) mean outer product about the centroid, units squared;
    a center that owns nothing has its nearest sample as centroid.  energy : mean squared distance to the owner.
    """

    masses: Annotated[np.ndarray, "(C) float64"]
    centroids: Annotated[np.ndarray, "(C, 3) float64"]
    second: Annotated[np.ndarray, "(C, 3, 3) float64"]
    energy: float

    @property
    def non_uniformity(self) -> float:
        """DFU: standard deviation over mean of the voxels per center."""
        return float(self.masses.std() / self.masses.mean())


def centroids(centers: np.ndarray, ownership: Ownership) -> np.ndarray:
    """(C, 3) where Lloyd's step would put each of (C, 3) centers."""
    return _first_moments(ownership.of(centers), centers, ownership.samples)[1]


def cells(centers: np.ndarray, ownership: Ownership) -> Cells:
    """Masses and first and second moments of the cells of (C, 3) centers."""
    owner, samples = ownership.of(centers), ownership.samples
    masses, middle = _first_moments(owner, centers, samples)
    offset = samples.positions - middle[owner]
    second = np.empty((len(centers), 3, 3))
    for i in range(3):
        for j in range(i, 3):
            second[:, i, j] = second[:, j, i] = np.bincount(owner, samples.masses * offset[:, i] * offset[:, j], len(centers))
    second /= np.maximum(masses, 1)[:, None, None]
    energy = float(samples.masses @ ownership.distances(centers) ** 2 / samples.masses.sum())
    return Cells(masses, middle, second, energy)


def spread(volume: Volume, count: int, settled: float = SETTLED) -> np.ndarray:
    """`count` centers (C, 3) spread evenly through a volume: parts of equal mass, relaxed on coarse levels first.

    settled : largest step, in s, that ends each level.  They rotate, move and scale with the body, up to the resolution of the voxels.
    """
    spacing = volume.center_spacing(count)
    centers = equal_parts(volume.finest, count)
    for level in volume.levels:
        ownership, largest = Ownership(level), np.inf
        for _ in range(MAX_STEPS):
            if largest < settled * spacing:
                break
            step = OVER_RELAXATION * (centroids(centers, ownership) - centers)
            centers, largest = centers + step, np.linalg.norm(step, axis=1).max()
    return centroids(centers, ownership)


def sums_by_owner(owner: np.ndarray, rows: np.ndarray, count: int) -> np.ndarray:
    """(count, K) sums of (N, K) rows.  owner : (N,) the center that each row belongs to."""
    # One pass over all columns in place of a bincount for each; the sums run in the same order.
    return sparse.csc_matrix((np.ones(len(owner)), owner, np.arange(len(owner) + 1)), (count, len(owner))) @ rows


def _first_moments(owner: np.ndarray, centers: np.ndarray, samples: VolumeSamples) -> tuple[np.ndarray, np.ndarray]:
    """Masses (C,) and centroids (C, 3) of the cells; owner : (N,) the center of each sample."""
    sums = sums_by_owner(owner, samples.moments, len(centers))
    masses, middle = sums[:, 0], sums[:, 1:] / np.maximum(sums[:, :1], 1)
    empty = np.flatnonzero(masses == 0)
    if len(empty):
        middle[empty] = samples.positions[samples.tree.query(centers[empty])[1]]
    return masses, middle
