"""Lloyd's relaxation: centers spread evenly through a volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .types import _FrozenArrays
from .volume import Volume, VolumeSamples

OVER_RELAXATION = 1.8  # published factor: a step goes this much of the way to the centroid and settles sooner
RELAXATION_STEPS = 100  # published number of steps for the first spread


@dataclass(frozen=True)
class Cells(_FrozenArrays):
    """The share of the volume nearest to each center.

    masses : (C,) voxels.  centroids : (C, 3).  second : (C, 3, 3) mean outer product about the centroid, units squared;
    a center that owns nothing has its nearest sample as centroid.  energy : mean squared distance to the owner.
    """

    masses: np.ndarray
    centroids: np.ndarray
    second: np.ndarray
    energy: float

    @property
    def non_uniformity(self) -> float:
        """DFU: standard deviation over mean of the voxels per center."""
        return float(self.masses.std() / self.masses.mean())


def centroids(centers: np.ndarray, samples: VolumeSamples) -> np.ndarray:
    """(C, 3) where Lloyd's step would put each of (C, 3) centers."""
    owner = _owners(centers, samples)[1]
    return _first_moments(owner, centers, samples)[1]


def cells(centers: np.ndarray, samples: VolumeSamples) -> Cells:
    """Masses and first and second moments of the cells of (C, 3) centers."""
    distance, owner = _owners(centers, samples)
    masses, middle = _first_moments(owner, centers, samples)
    offset = samples.positions - middle[owner]
    second = np.empty((len(centers), 3, 3))
    for i in range(3):
        for j in range(i, 3):
            second[:, i, j] = second[:, j, i] = np.bincount(owner, samples.masses * offset[:, i] * offset[:, j], len(centers))
    second /= np.maximum(masses, 1)[:, None, None]
    energy = float(samples.masses @ distance**2 / samples.masses.sum())
    return Cells(masses, middle, second, energy)


def spread(volume: Volume, count: int, rng: np.random.Generator) -> np.ndarray:
    """`count` centers (C, 3) spread evenly through a volume, coarse levels first."""
    samples = volume.finest
    chosen = rng.choice(len(samples.positions), count, replace=len(samples.positions) < count, p=samples.masses / samples.masses.sum())
    # Anywhere in their blocks: a start on the voxels' own lattice is full of ties, which rounding would settle, so that
    # a body in other units, or elsewhere, would get other centers.
    centers = samples.positions[np.sort(chosen)] + (rng.random((count, 3)) - 0.5) * samples.spacing
    share = RELAXATION_STEPS // len(volume.levels)
    for level in volume.levels:
        for _ in range(share):
            centers = centers + OVER_RELAXATION * (centroids(centers, level) - centers)
    return centroids(centers, samples)


def _owners(centers: np.ndarray, samples: VolumeSamples) -> tuple[np.ndarray, np.ndarray]:
    return cKDTree(centers).query(samples.positions, workers=-1)


def _first_moments(owner, centers, samples) -> tuple[np.ndarray, np.ndarray]:
    count = len(centers)
    masses = np.bincount(owner, samples.masses, count)
    middle = np.stack([np.bincount(owner, samples.masses * samples.positions[:, k], count) for k in range(3)], axis=1)
    middle /= np.maximum(masses, 1)[:, None]
    empty = np.flatnonzero(masses == 0)
    if len(empty):
        middle[empty] = samples.positions[cKDTree(samples.positions).query(centers[empty])[1]]
    return masses, middle
