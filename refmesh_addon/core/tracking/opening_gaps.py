"""Gaps that open between parts that were fused: an arm that lifts from the side, a hand that leaves the hip.

While parts are fused, the volume does not tell them apart, and each pulls on the other's centers; once a gap opens, centers stay in it.
Backward in time the same parts come together, and no center is in doubt. So where centers end in a gap, motions are taken from other
centers, spread through the new frame and tracked backward into the one before.

Centers may also lie outside because volume has receded, as where air leaves a shirt, or because parts slide along each other. There
backward tracking does not help, and it is not tried again before more centers lie outside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.rotations import rigid_motions
from ..settings import TrackingSettings
from . import lloyd
from .affinity import Affinity, near_pairs, updated
from .forward import TrackedFrame, next_frame, settled
from .ownership import Ownership
from .volume import Volume

GAP = 0.25  # distance from the volume, in s, at which a center is in a gap; in the hollows of bent parts a few come half as far
LINE = (0.25, 0.5, 0.75)  # where the line between two centers is looked at
SPREAD = 0.02  # largest step, in s, at which centers are spread evenly enough for this
REMAINING = 0.5  # share of them that may; parts that slide along each other without coming apart leave nearly all
EXPLAINED = 1.25  # Lloyd energy after backward tracking against that of the spread: above it, a part is missing in the new frame


def tracked_on(last: TrackedFrame, volume: Volume, settings: TrackingSettings, before: Callable[[], Volume] | None) -> TrackedFrame:
    """`next_frame`; where centers end in gaps, once more with the motions of backward tracking, if at most REMAINING of them do then.

    before : makes the volume of the last frame; None where it is not that of the centers.
    """
    state = replace(next_frame(last, volume, settings), receded=last.receded)
    if before is None or volume.is_view:  # views have centers out of view
        return state
    spacing = last.affinity.spacing
    stuck = np.count_nonzero(in_gaps(state.centers, volume, spacing))
    if stuck <= last.receded:
        return state
    opened = _opened(last, before(), volume, settings)
    if opened is None or np.count_nonzero(in_gaps(opened.centers, volume, spacing)) > REMAINING * stuck:
        return replace(state, receded=stuck)
    return opened


def in_gaps(points: np.ndarray, volume: Volume, spacing: float) -> np.ndarray:
    """(N,) bool, which of (N, 3) points lie outside the volume by GAP at least.  spacing : s, scene units."""
    samples = volume.finest
    return samples.tree.query(points, workers=-1)[0] > GAP * spacing + 0.5 * samples.spacing


def _opened(last: TrackedFrame, before: Volume, volume: Volume, settings: TrackingSettings) -> TrackedFrame | None:
    """The next frame by motions tracked backward; None where they do not lead to the volume before."""
    spread, back = _tracked_back(last, before, volume, settings)
    if back.cells.energy > EXPLAINED * spread.cells.energy:
        return None
    nearest = cKDTree(back.centers).query(last.centers)[1]
    motions = rigid_motions(back.affinity.weights(), back.centers, spread.centers).of(nearest)
    guess = motions.apply(last.centers)
    known = replace(last, affinity=updated(last.affinity, guess, last.cells, motions, settings.affinity))
    state = settled(known, guess, volume, settings)
    # Centers that lay astride of the contact still pull from one side of the gap on the other.
    places = _in_volume(state.centers, volume)
    known = replace(known, affinity=without_gaps(state.affinity, places, volume))
    return settled(known, places, replace(volume, levels=volume.levels[-1:]), settings)


def _tracked_back(last: TrackedFrame, before: Volume, volume: Volume, settings: TrackingSettings) -> tuple[TrackedFrame, TrackedFrame]:
    """As many centers spread through the new frame, and the same in the frame before."""
    coarse = replace(volume, levels=volume.levels[:-1] or volume.levels)  # spreads centers evenly enough, in a fifth of the time
    centers, spacing = lloyd.spread(coarse, len(last.centers), SPREAD), last.affinity.spacing
    affinity = without_gaps(near_pairs(centers, spacing), centers, volume)
    spread = TrackedFrame(centers, centers, affinity, lloyd.cells(centers, Ownership(volume.finest)), 0.0, 0)
    return spread, next_frame(spread, before, settings)


def _in_volume(centers: np.ndarray, volume: Volume) -> np.ndarray:
    """(C, 3) centers, those outside on their nearer side of the gap."""
    samples = volume.finest
    distance, nearest = samples.tree.query(centers)
    return np.where((distance > samples.spacing)[:, None], samples.positions[nearest], centers)


def without_gaps(affinity: Affinity, centers: np.ndarray, volume: Volume) -> Affinity:
    """The affinity in which pairs on two sides of a gap do not agree.  centers : (C, 3)."""
    first, second = centers[affinity.first], centers[affinity.second]
    across = np.zeros(len(first), dtype=bool)
    for share in LINE:
        across |= in_gaps((1 - share) * first + share * second, volume, affinity.spacing)
    return replace(affinity, agreement=np.where(across, 0.0, affinity.agreement))
