"""As-rigid-as-possible volume tracking, frame by frame (paper, section "As-Rigid-As-Possible Volume Tracking").

Every center is pulled to the centroid of its share of the volume (uniform spread) and to where the best rigid motion of
its neighbourhood carries it (coherent motion). Most of the way is done on coarse samples of the volume.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import lloyd
from .affinity import Affinity, near_pairs, updated
from .rotations import RigidMotions, rigid_motions
from .settings import TrackingSettings
from .types import _FrozenArrays
from .volume import Volume

PRESMOOTHING_STEPS = 10  # published: rigid pulls alone after the prediction, before the volume has a say
LLOYD_WEIGHT, ARAP_WEIGHT = 1.0, 2.0  # shares of the two pulls in a step
STEP_STOP = (0.03, 0.01, 0.004)  # largest step, in s, that ends each level; the last is the published 1e-4 at 1.8 units
MOST_STEPS = (100, 60, 60)  # per level; the piecewise-constant Lloyd pull may circle just above the stop


@dataclass(frozen=True)
class TrackedFrame(_FrozenArrays):
    """Where the centers are in one frame, and what the next one needs.

    centers, before : (C, 3) in this frame and the one before (the same array for the first).
    dfu : standard deviation over mean of voxels per center.  lloyd_energy, arap_energy : in s^2.  steps : steps taken.
    """

    centers: np.ndarray
    before: np.ndarray
    affinity: Affinity
    dfu: float
    lloyd_energy: float
    arap_energy: float
    steps: int


def first_frame(volume: Volume, settings: TrackingSettings) -> TrackedFrame:
    """Centers spread evenly through the first frame's volume."""
    spacing = volume.center_spacing(settings.centers)
    centers = lloyd.spread(volume, settings.centers, np.random.default_rng(settings.seed))
    cells = lloyd.cells(centers, volume.finest)
    return TrackedFrame(centers, centers, near_pairs(centers, spacing), cells.non_uniformity, cells.energy / spacing**2, 0.0, 0)


def next_frame(last: TrackedFrame, before: Volume, volume: Volume, settings: TrackingSettings) -> TrackedFrame:
    """Centers carried from the `before` volume, where `last` has them, into the next frame's `volume`."""
    spacing, weights, old = last.affinity.spacing, last.affinity.weights(), last.centers
    centers = 2 * old - last.before
    for _ in range(PRESMOOTHING_STEPS):
        centers = rigid_motions(weights, old, centers).apply(old)
    steps = 0
    for level, stop, most in zip(volume.levels, STEP_STOP[-len(volume.levels) :], MOST_STEPS[-len(volume.levels) :], strict=True):
        for _ in range(most):
            step = _step(centers, old, weights, level)
            centers = centers + step
            steps += 1
            if np.linalg.norm(step, axis=1).max() < stop * spacing:
                break
    motions = rigid_motions(weights, old, centers)
    affinity = updated(last.affinity, centers, lloyd.cells(old, before.finest), motions, settings.affinity)
    cells = lloyd.cells(centers, volume.finest)
    return TrackedFrame(
        centers, old, affinity, cells.non_uniformity, cells.energy / spacing**2, _arap_energy(motions, old, centers, spacing), steps
    )


def _step(centers, old, weights, level) -> np.ndarray:
    to_centroid = lloyd.centroids(centers, level) - centers
    to_rigid = rigid_motions(weights, old, centers).apply(old) - centers
    return (LLOYD_WEIGHT * to_centroid + ARAP_WEIGHT * to_rigid) / (LLOYD_WEIGHT + ARAP_WEIGHT)


def _arap_energy(motions: RigidMotions, old: np.ndarray, centers: np.ndarray, spacing: float) -> float:
    """Mean squared distance of a center from where its neighbourhood's rigid motion carries it, in s^2."""
    apart = motions.apply(old) - centers
    return float(np.einsum("ni,ni->", apart, apart) / (len(centers) * spacing**2))
