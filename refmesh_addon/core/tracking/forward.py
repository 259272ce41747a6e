"""As-rigid-as-possible volume tracking, frame by frame (paper, section "As-Rigid-As-Possible Volume Tracking").

Every center is pulled to the centroid of its share of the volume (uniform spread) while its kin move as rigidly as they
can (coherent motion). Published is a weighted mean of two local steps; here each step solves for all centers together,
so that a pull which only the surface feels moves a whole limb. Most of the way is done on coarse samples of the volume.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.rotations import RigidMotions, rigid_motions
from ..settings import TrackingSettings
from ..types import FrozenArrays
from . import lloyd
from .affinity import Affinity, near_pairs, updated
from .first_guess import first_guess
from .lloyd import Cells
from .ownership import Ownership
from .rigidity import Rigidity
from .volume import Volume

ARAP_WEIGHT = 20.0  # of the rigidity against the pull to the centroids; less follows noise, more resists real bending
OVER_RELAXATION, MOMENTUM = 1.2, 0.5  # of the steps; the volume pulls only at its surface, so whole limbs settle slowly without
INERTIA = 0.65  # share of the last motion in the first guess; with all of it (published) a ball once set spinning never stops
STEP_STOP = (0.02, 0.007, 0.003)  # largest step, in s, that ends each level; the last is about the published 1e-4 at 1.8 units
MOST_STEPS = (100, 60, 60)  # per level; the piecewise-constant Lloyd pull may circle just above the stop


@dataclass(frozen=True)
class TrackedFrame(FrozenArrays):
    """Where the centers are in one frame, and what the next one needs.

    centers, before : (C, 3) in this frame and the one before (the same array for the first).
    cells : the centers' shares of this frame's volume.  arap_energy : in s^2.  steps : steps taken.
    """

    centers: np.ndarray
    before: np.ndarray
    affinity: Affinity
    cells: Cells
    arap_energy: float
    steps: int

    @property
    def dfu(self) -> float:
        """Standard deviation over mean of the voxels per center."""
        return self.cells.non_uniformity

    @property
    def lloyd_energy(self) -> float:
        """Mean squared distance of the volume from the centers that own it, in s^2."""
        return self.cells.energy / self.affinity.spacing**2


def first_frame(volume: Volume, settings: TrackingSettings) -> TrackedFrame:
    """Centers spread evenly through the first frame's volume."""
    centers = lloyd.spread(volume, settings.centers)
    affinity = near_pairs(centers, volume.center_spacing(settings.centers))
    return TrackedFrame(centers, centers, affinity, lloyd.cells(centers, Ownership(volume.finest)), 0.0, 0)


def next_frame(last: TrackedFrame, volume: Volume, settings: TrackingSettings) -> TrackedFrame:
    """Centers carried from where `last` has them into the next frame's volume."""
    old, spacing = last.centers, last.affinity.spacing
    centers = first_guess(old, old + INERTIA * (old - last.before), last.cells, volume.levels[0], spacing)
    affinity, steps = last.affinity, 0
    for level, stop, most in zip(volume.levels, STEP_STOP[-len(volume.levels) :], MOST_STEPS[-len(volume.levels) :], strict=True):
        weights, ownership = affinity.weights(), Ownership(level)
        centers, taken = _settled(centers, Rigidity(weights, old), ownership, stop * spacing, most)
        # What moves apart in this very frame must not pull on each other on the finer levels.
        motions = rigid_motions(weights, old, centers)
        affinity, steps = updated(last.affinity, centers, last.cells, motions, settings.affinity), steps + taken
    cells = lloyd.cells(centers, ownership)
    return TrackedFrame(centers, old, affinity, cells, _arap_energy(motions, old, centers, spacing), steps)


def _settled(centers: np.ndarray, rigidity: Rigidity, ownership: Ownership, stop: float, most: int) -> tuple[np.ndarray, int]:
    """Steps on one level until the largest is below `stop`, scene units; returns the centers and the number of steps."""
    step, taken, largest = np.zeros_like(centers), 0, np.inf
    while taken < most and largest >= stop:
        pull = rigidity.pulled(centers, lloyd.centroids(centers, ownership), ARAP_WEIGHT) - centers
        step = MOMENTUM * step + OVER_RELAXATION * pull
        centers, taken, largest = centers + step, taken + 1, np.linalg.norm(step, axis=1).max()
    return centers, taken


def _arap_energy(motions: RigidMotions, old: np.ndarray, centers: np.ndarray, spacing: float) -> float:
    """Mean squared distance of a center from where its neighbourhood's rigid motion carries it, in s^2."""
    apart = motions.apply(old) - centers
    return float(np.einsum("ni,ni->", apart, apart) / (len(centers) * spacing**2))
