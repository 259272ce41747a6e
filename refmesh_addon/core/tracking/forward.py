"""As-rigid-as-possible volume tracking, frame by frame (paper, section "As-Rigid-As-Possible Volume Tracking").

Every center is pulled to the centroid of its cell of the volume (uniform distribution) while its neighborhood moves as
rigidly as possible (coherent motion). Published is a weighted mean of two local steps; here each step solves for all centers
together, so that a pull which acts at the surface only moves a whole limb. Most of the way is done on coarse samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated

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
from .view_pull import ViewPull
from .volume import Volume

Pull = Callable[[np.ndarray], np.ndarray]  # where a step would take (C, 3) centers

ARAP_WEIGHT = 20.0  # of the rigidity against the pull to the centroids; less follows noise, more resists real bending
# The same of what a camera sees: a sheet's volume hardly holds it along the sheet. At 160, bodies that bend slip farther.
VIEW_ARAP_WEIGHT = 100.0
# So stiff a graph takes more steps to come to rest. Where they end as early as those of closed volumes, the centers of a turning body lag
# behind, and what they lag adds up.
VIEW_SOLVER_STEPS, VIEW_STOP, VIEW_STEPS = 20, 0.5, 2  # in conjugate gradients; times STEP_STOP; times MAX_STEPS
OVER_RELAXATION, MOMENTUM = 1.2, 0.5  # of the steps; without them whole limbs converge slowly, since the volume pulls at its surface only
INERTIA = 0.65  # share of the last motion in the first guess; with all of it (published) a ball that spins once never stops
STEP_STOP = (0.02, 0.007, 0.003)  # largest step, in s, that ends each level; the last is about the published 1e-4 at 1.8 units
MAX_STEPS = (100, 60, 60)  # per level; the piecewise-constant Lloyd pull may circle just above the stop


@dataclass(frozen=True)
class TrackedFrame(FrozenArrays):
    """The centers in one frame, and what tracking the next one needs.

    centers, before : (C, 3) in this frame and the one before (the same array for the first).
    cells : of the centers in this frame's volume.  arap_energy : in s^2.  steps : number of steps.
    active : (C,) bool, False for centers that were retired; None where all are.
    receded : number of centers outside the volume that no gap explains, see `opening_gaps`.
    """

    centers: Annotated[np.ndarray, "(C, 3) float64"]
    before: Annotated[np.ndarray, "(C, 3) float64"]
    affinity: Affinity
    cells: Cells
    arap_energy: float
    steps: int
    active: Annotated[np.ndarray, "(C) bool"] | None = None
    receded: int = 0

    @property
    def active_centers(self) -> np.ndarray:
        """(C,) bool, which centers were not retired."""
        return np.ones(len(self.centers), dtype=bool) if self.active is None else self.active

    @property
    def dfu(self) -> float:
        """Standard deviation over mean of the voxels per center."""
        return replace(self.cells, masses=self.cells.masses[self.active_centers]).non_uniformity

    @property
    def lloyd_energy(self) -> float:
        """Mean squared distance of the volume from the centers that own it, in s^2."""
        return self.cells.energy / self.affinity.spacing**2


def first_frame(volume: Volume, settings: TrackingSettings) -> TrackedFrame:
    """Centers spread evenly through the first frame's volume.

    >>> settings = TrackingSettings(centers=50, resolution=32)
    >>> first_frame(sample_volume(ball, settings.resolution, settings.centers), settings).centers.shape
    (50, 3)
    """
    centers = lloyd.spread(volume, settings.centers)
    affinity = near_pairs(centers, volume.center_spacing(settings.centers))
    return TrackedFrame(centers, centers, affinity, lloyd.cells(centers, Ownership(volume.finest)), 0.0, 0)


def next_frame(last: TrackedFrame, volume: Volume, settings: TrackingSettings) -> TrackedFrame:
    """Centers carried from where `last` has them into the next frame's volume.

    >>> volume = sample_volume(ball.moved(ball.vertices + [0.5, 0, 0]), resolution=32, count=50)
    >>> state = next_frame(tracked, volume, TrackingSettings(centers=50, resolution=32))
    >>> np.abs((state.centers - tracked.centers).mean(axis=0)).round(2)
    array([0.5, 0. , 0. ])
    """
    old, spacing = last.centers, last.affinity.spacing
    predicted = old + INERTIA * (old - last.before)
    return settled(last, first_guess(old, predicted, last.cells, volume.levels[0], spacing), volume, settings)


def settled(last: TrackedFrame, centers: np.ndarray, volume: Volume, settings: TrackingSettings) -> TrackedFrame:
    """The next frame, in whose volume the centers have come to rest, level by level.  centers : (C, 3) the guess to start from."""
    old, spacing = last.centers, last.affinity.spacing
    affinity, steps, finer, longer = last.affinity, 0, *((VIEW_STOP, VIEW_STEPS) if volume.is_view else (1.0, 1))
    for level, stop, most in zip(volume.levels, STEP_STOP[-len(volume.levels) :], MAX_STEPS[-len(volume.levels) :], strict=True):
        weights, ownership = affinity.weights(), Ownership(level)
        pull = _pull(Rigidity(weights, old), ownership, volume, spacing)
        centers, taken = _converged(centers, pull, finer * stop * spacing, longer * most)
        # Parts that separate in this very frame must not pull on each other on the finer levels.
        motions = rigid_motions(weights, old, centers)
        affinity, steps = updated(last.affinity, centers, last.cells, motions, settings.affinity), steps + taken
    cells = lloyd.cells(centers, ownership)
    return TrackedFrame(centers, old, affinity, cells, _arap_energy(motions, old, centers, spacing), steps)


def _pull(rigidity: Rigidity, ownership: Ownership, volume: Volume, spacing: float) -> Pull:
    """Toward the volume and toward rigidity, on one level of a volume."""
    if volume.is_view:
        goals = ViewPull(rigidity, ownership, volume.levels[0], spacing).goals
        return lambda centers: rigidity.pulled(centers, goals(centers), VIEW_ARAP_WEIGHT, VIEW_SOLVER_STEPS)
    return lambda centers: rigidity.pulled(centers, lloyd.centroids(centers, ownership), ARAP_WEIGHT)


def _converged(centers: np.ndarray, pull: Pull, stop: float, most: int) -> tuple[np.ndarray, int]:
    """The centers after steps on one level until the largest is below `stop`, scene units, and the number of steps."""
    step, taken, largest = np.zeros_like(centers), 0, np.inf
    while taken < most and largest >= stop:
        step = MOMENTUM * step + OVER_RELAXATION * (pull(centers) - centers)
        centers, taken, largest = centers + step, taken + 1, np.linalg.norm(step, axis=1).max()
    return centers, taken


def _arap_energy(motions: RigidMotions, old: np.ndarray, centers: np.ndarray, spacing: float) -> float:
    """Mean squared distance of a center from where the rigid motion of its neighborhood carries it, in s^2."""
    difference = motions.apply(old) - centers
    return float(np.einsum("ni,ni->", difference, difference) / (len(centers) * spacing**2))
