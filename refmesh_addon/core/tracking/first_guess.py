"""The first guess of the centers in a new frame, also where everything jumps: frames far apart in time, or an origin set anew.

Too far off, the pull to the volume would send centers into the wrong limbs. Moved as one rigid body, they reach it first.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.rotations import rigid_motions
from . import lloyd
from .lloyd import Cells
from .ownership import Ownership
from .volume import VolumeSamples

JUMP = 3.0  # Lloyd energy of the prediction against that of the last frame, which motion within a take stays below
# The same after a rigid motion that explains the jump; where a body has appeared or left, none of the others' motions reaches this.
EXPLAINED = 2.0
MAX_STEPS = 200
CONVERGED = 0.02  # largest step, in s


def first_guess(old: np.ndarray, predicted: np.ndarray, cells: Cells, samples: VolumeSamples, spacing: float) -> np.ndarray:
    """(C, 3) the predicted centers; where the new volume lies far from them, the old ones moved rigidly, if that brings them into it.

    old, predicted : (C, 3).  cells : of the old centers in the last volume.  samples : of the new volume.  spacing : s.
    """
    if _energy(predicted, samples) < JUMP * cells.energy:
        return predicted
    moved = _moved_rigidly(old, cells, samples, spacing)
    return moved if _energy(moved, samples) < EXPLAINED * cells.energy else predicted


def _moved_rigidly(old: np.ndarray, cells: Cells, samples: VolumeSamples, spacing: float) -> np.ndarray:
    """(C, 3) centers moved as one: centroid onto centroid, then to the centroids of their cells, which change on the way."""
    ownership = Ownership(samples)
    centroid = samples.masses @ samples.positions / samples.masses.sum()
    centers = old - cells.masses @ cells.centroids / cells.masses.sum() + centroid
    for _ in range(MAX_STEPS):
        now = lloyd.cells(centers, ownership)
        motion = rigid_motions(sparse.csr_matrix(now.masses), centers, now.centroids)
        last, centers = centers, (centers - motion.sources[0]) @ motion.rotations[0].T + motion.targets[0]
        if np.linalg.norm(centers - last, axis=1).max() < CONVERGED * spacing:
            break
    return centers


def _energy(centers: np.ndarray, samples: VolumeSamples) -> float:
    return lloyd.cells(centers, Ownership(samples)).energy
