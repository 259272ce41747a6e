"""A body that moves rigidly for three frames, its volume in samples, and centers spread through it."""

import numpy as np
from scipy.spatial.transform import Rotation

from refmesh_addon.core.tracking import lloyd
from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.tracking.coarse_samples import coarse_samples
from refmesh_addon.core.tracking.ownership import Ownership
from refmesh_addon.core.tracking.volume import VolumeSamples, sample_volume

from ..shapes import box, joined

COUNT, FRAMES = 30, 3
BODY = joined(box(), box((0.5, 0.5, 0.9), center=(0.9, 0.2, 0.7)))
VOLUME = sample_volume(BODY, 24, COUNT)
SPACING = VOLUME.center_spacing(COUNT)
SAMPLES = coarse_samples(VOLUME, COUNT)
EVEN = lloyd.spread(VOLUME, COUNT)
TURNS = [Rotation.from_rotvec([0.1 * step, 0.0, 0.05 * step]).as_matrix() for step in range(FRAMES)]
SHIFTS = [SPACING * step * np.array([0.5, 0.3, -0.2]) for step in range(FRAMES)]
MOTION = list(zip(TURNS, SHIFTS, strict=True))


def moved_samples(samples, turn, shift, scale=1.0):
    return VolumeSamples(scale * samples.positions @ turn.T + shift, samples.masses, scale * samples.spacing)


def samples_of(frame):
    return moved_samples(SAMPLES, *MOTION[frame])


def carried(centers):
    return np.stack([centers @ turn.T + shift for turn, shift in MOTION])


def settled(steps=300):
    """Centers that Lloyd's relaxation on these very samples leaves where they are."""
    centers = EVEN
    for _ in range(steps):
        centers = lloyd.centroids(centers, Ownership(SAMPLES))
    return centers


def shaken(seed=0, size=0.2):
    return carried(EVEN) + size * SPACING * np.random.default_rng(seed).normal(size=(FRAMES, COUNT, 3))


def weights_of(positions):
    return near_pairs(positions[0], SPACING).weights()
