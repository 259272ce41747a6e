"""Centers that are born where a camera comes to see more of a body, and retired where it no longer sees it.

Centers do not slide along a body to even out what is seen, see `view_pull`, so that new surface has none. Once that is a certain share
of what is seen, centers are born there, at the spacing of the others, and those that see nothing any more are retired. Until then the
new surface follows the nearest centers, and centers out of view move as rigidly as possible with their neighbors.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import lloyd
from .affinity import Affinity, near_pairs
from .forward import TrackedFrame
from .ownership import Ownership
from .population import FEWEST, retired_centers, with_centers
from .view_pull import REACH, near_cells
from .volume import Volume

FAR = 1.25  # distance, in s, from all centers from which on volume has none
# Share of the volume that may be so far from all centers, and farther than DEEP, in s: there, motions are extrapolated too far. With less
# than these, another mesh would begin every few frames.
MOST_NEW, DEEP, MOST_DEEP = 0.1, 2.0, 0.04
UNSEEN = 0.1  # share of s^3 near a center that is seen, below which it sees nothing


def repopulated(state: TrackedFrame, volume: Volume) -> TrackedFrame:
    """The state of a frame with centers where there are none, and without those out of view, if enough has come into view.

    volume : of that frame, a view.
    """
    spacing, samples = state.affinity.spacing, volume.finest
    active = np.flatnonzero(state.active_centers)
    ownership = Ownership(samples)
    ownership.of(state.centers[active])
    distances = ownership.distances(state.centers[active]) / spacing
    far, shares = distances > FAR, samples.masses / samples.masses.sum()
    count = round(samples.masses[far].sum() * volume.voxel**3 / spacing**3)
    if (shares[far].sum() < MOST_NEW and shares[distances > DEEP].sum() < MOST_DEEP) or count < FEWEST:
        return state
    masses, _ = near_cells(state.centers[active], ownership, REACH * spacing)
    unseen = masses * volume.voxel**3 < UNSEEN * spacing**3
    state = retired_centers(state, active[unseen])
    born = lloyd.spread(replace(volume, levels=(samples.where(far),)), count)
    return with_centers(state, born, volume, _beside(state, born))


def _beside(state: TrackedFrame, born: np.ndarray) -> Affinity:
    """All pairs within reach in which there is a center that is born; new surface belongs to the body beside it."""
    active = np.flatnonzero(state.active_centers)
    number = np.concatenate([active, len(state.centers) + np.arange(len(born))]).astype(np.int32)
    pairs = near_pairs(np.concatenate([state.centers[active], born]), state.affinity.spacing)
    new = pairs.second >= len(active)  # the larger number of the two
    first, second, separation, agreement = (values[new] for values in (pairs.first, pairs.second, pairs.separation, pairs.agreement))
    return Affinity(number[first], number[second], separation, agreement, len(state.centers) + len(born), pairs.spacing)
