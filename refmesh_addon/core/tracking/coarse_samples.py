"""A volume in fewer samples, for methods that go through the samples of all frames many times."""

from __future__ import annotations

import numpy as np

from .volume import Volume, VolumeSamples

SAMPLES_PER_CENTER = 60  # with some 15 centers settle into the blocks: lower energy there, higher on the finest level
COARSER = 1.5  # least edge of a block, in edges of the finest blocks, at which it is worth joining them


def coarse_samples(volume: Volume, count: int) -> VolumeSamples:
    """About SAMPLES_PER_CENTER blocks of a volume for each of `count` centers, with exact masses and centroids.

    The volume's own levels are steps of eight and more apart, and here every sample counts in every iteration.
    """
    finest = volume.finest
    edge = (volume.size / (SAMPLES_PER_CENTER * count)) ** (1 / 3)
    if edge < COARSER * finest.spacing:
        return finest
    block = np.floor((finest.positions - finest.positions.min(axis=0)) / edge).astype(np.int64)
    _, block = np.unique(np.ravel_multi_index(block.T, block.max(axis=0) + 1), return_inverse=True)
    masses = np.bincount(block, finest.masses)
    moments = np.stack([np.bincount(block, finest.masses * axis) for axis in finest.positions.T], axis=1)
    return VolumeSamples(moments / masses[:, None], masses, edge)
