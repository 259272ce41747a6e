"""A first guess where everything leaps: between frames far apart in time, or where the origin was set anew.

From a place too far off, the pull to the volume sends centers into the wrong limbs. Moved as one body, they find back first.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.rotations import rigid_motions
from . import lloyd
from .lloyd import Cells
from .ownership import Ownership
from .volume import VolumeSamples

ASTRAY = 3.0  # mean squared distance of the volume from its centers, against that in the last frame, that motion within a take stays below
FOUND = 2.0  # the same after a leap that is one; where a body has come or gone, no motion of all that was there brings it down to this
MOST_STEPS = 200
SETTLED = 0.02  # largest step, in s


def first_guess(old: np.ndarray, predicted: np.ndarray, cells: Cells, samples: VolumeSamples, spacing: float) -> np.ndarray:
    """(C, 3) the predicted centers; where the new volume lies far from them, the old ones moved rigidly, if that brings them into it.

    old, predicted : (C, 3).  cells : the old ones' shares of the last volume.  samples : of the new volume.  spacing : s.
    """
    if _energy(predicted, samples) < ASTRAY * cells.energy:
        return predicted
    leapt = _moved_as_one(old, cells, samples, spacing)
    return leapt if _energy(leapt, samples) < FOUND * cells.energy else predicted


def _moved_as_one(old: np.ndarray, cells: Cells, samples: VolumeSamples, spacing: float) -> np.ndarray:
    """(C, 3) centers moved rigidly: middle onto middle, then to the centroids of their shares, which change on the way."""
    ownership, total = Ownership(samples), samples.masses.sum()
    middle = samples.masses @ samples.positions / total
    centers = old - cells.masses @ cells.centroids / cells.masses.sum() + middle
    for _ in range(MOST_STEPS):
        now = lloyd.cells(centers, ownership)
        motion = rigid_motions(sparse.csr_matrix(now.masses), centers, now.centroids)
        moved = (centers - motion.sources[0]) @ motion.rotations[0].T + motion.targets[0]
        step = moved - centers
        centers = moved
        if np.linalg.norm(step, axis=1).max() < SETTLED * spacing:
            break
    return centers


def _energy(centers: np.ndarray, samples: VolumeSamples) -> float:
    return lloyd.cells(centers, Ownership(samples)).energy
