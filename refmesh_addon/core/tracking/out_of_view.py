"""Where centers are while a camera does not see them: before they are born, and after they are retired.

They move as rigidly as possible with the centers that are tracked, so that one mesh serves frames of which each shows something else.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from .rigidity import Rigidity

ITERATIONS = 3  # local/global, from the shape in the frame before, which changes little


def carried_out_of_view(positions: np.ndarray, active: np.ndarray, weights: sparse.csr_matrix) -> np.ndarray:
    """(F, C, 3) positions, with those of centers out of view carried along.

    positions : (F, C, 3), scene units.  active : (F, C) bool, where they were tracked, in successive frames of each center.
    weights : (C, C) symmetric affinities.
    """
    positions, first, last = positions.copy(), active.argmax(axis=0), len(active) - 1 - active[::-1].argmax(axis=0)
    for frame in range(1, len(positions)):
        _carry(positions, (frame - 1, frame), active, last < frame, weights)
    for frame in range(len(positions) - 2, -1, -1):
        _carry(positions, (frame + 1, frame), active, first > frame, weights)
    return positions


def _carry(positions: np.ndarray, step: tuple[int, int], active: np.ndarray, gone: np.ndarray, weights: sparse.csr_matrix) -> None:
    """Moves the centers that are gone, (C,) bool, from where they are in the first frame of a step to the second."""
    before, now = step
    held = active[before] & active[now]
    there = np.flatnonzero(gone | held)
    if gone.any() and held.any():
        rigidity = Rigidity(weights[there][:, there].tocsr(), positions[before, there])
        positions[now, there] = rigidity.carried(positions[now, there], gone[there], ITERATIONS)
