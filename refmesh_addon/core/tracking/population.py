"""Centers that are born and retired while a take is followed, as bodies come and go.

The rule: a body that comes gets as many centers as its volume holds at the spacing s of the first frame, so that all bodies are equally
fine; the centers inside a body that leaves are retired after its last frame. No center moves from one body to another. Retired
centers keep their numbers and their last place, and take part in nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..geometry.winding import enclosed_by
from ..settings import TrackingSettings
from ..types import TriangleMesh
from . import lloyd
from .affinity import Affinity, near_pairs
from .forward import TrackedFrame
from .lloyd import Cells
from .opening_gaps import tracked_on
from .ownership import Ownership
from .volume import Volume, sample_volume

FEWEST = 4  # centers of a body, however small: fewer have no rotation


@dataclass(frozen=True)
class Change:
    """What comes and goes between two frames.

    departure : what is in the last frame only, arrival : what is in the new one only, both closed; None where nothing is.
    settled : volume of the new frame without what arrives.
    before : makes the volume of the last frame; None where something departs, or where gaps that open are not looked for.
    """

    departure: TriangleMesh | None
    arrival: TriangleMesh | None
    settled: Volume
    before: Callable[[], Volume] | None = None


def advanced(last: TrackedFrame, volume: Volume, change: Change, settings: TrackingSettings) -> TrackedFrame:
    """`tracked_on` where bodies may come and go.

    volume : of the new frame.  Raises ValueError where a body that comes holds too few voxels.
    """
    if change.departure is not None:
        last = retired(last, change.departure)
    state = followed(last, change.settled, settings, change.before)
    return state if change.arrival is None else with_born(state, change.arrival, volume, settings)


def followed(
    last: TrackedFrame, volume: Volume, settings: TrackingSettings, before: Callable[[], Volume] | None = None
) -> TrackedFrame:
    """`tracked_on` for the active centers; retired ones stay where they are."""
    if last.active is None:
        return tracked_on(last, volume, settings, before)
    chosen = np.flatnonzero(last.active)
    return _merged(last, chosen, tracked_on(_restricted(last, chosen), volume, settings, before))


def retired(state: TrackedFrame, body: TriangleMesh) -> TrackedFrame:
    """The state without the centers inside a body that leaves; at least one center stays.  body : closed, in the frame of the state."""
    return retired_centers(state, enclosed_by(body)(state.centers))


def retired_centers(state: TrackedFrame, leaving: np.ndarray) -> TrackedFrame:
    """The state without the centers that are marked or listed in `leaving`; at least one center stays."""
    remaining = state.active_centers.copy()
    remaining[leaving] = False
    return replace(state, active=remaining) if remaining.any() else state


def with_born(state: TrackedFrame, body: TriangleMesh, volume: Volume, settings: TrackingSettings) -> TrackedFrame:
    """The state with centers spread through a body that has come.

    body : closed, in the frame of the state.  volume : of the whole frame.  Raises ValueError where the body holds too few voxels.
    """
    spacing = state.affinity.spacing
    own = sample_volume(body, settings.resolution, FEWEST)
    count = max(FEWEST, round(own.size / spacing**3))
    born = lloyd.spread(sample_volume(body, settings.resolution, count), count)
    pairs = near_pairs(born, spacing)  # none with other centers, as a body that comes is apart
    first, second = (number + np.int32(len(state.centers)) for number in (pairs.first, pairs.second))
    return with_centers(state, born, volume, replace(pairs, first=first, second=second))


def with_centers(state: TrackedFrame, born: np.ndarray, volume: Volume, pairs: Affinity) -> TrackedFrame:
    """The state with (N, 3) centers that are born.  volume : of the whole frame.  pairs : with them, numbered after those of the state."""
    active = np.concatenate([state.active_centers, np.ones(len(born), dtype=bool)])
    centers = np.concatenate([state.centers, born])
    cells = lloyd.cells(centers[active], Ownership(volume.finest))
    return TrackedFrame(
        centers,
        np.concatenate([state.before, born]),
        _joined(state.affinity, pairs, len(centers)),
        _spread_out(cells, np.flatnonzero(active), centers),
        state.arap_energy,
        state.steps,
        active,
        state.receded,
    )


def _restricted(state: TrackedFrame, chosen: np.ndarray) -> TrackedFrame:
    """The state of some centers, by index, alone."""
    cells = Cells(state.cells.masses[chosen], state.cells.centroids[chosen], state.cells.second[chosen], state.cells.energy)
    pairs, number = state.affinity, np.full(len(state.centers), -1, dtype=np.int32)
    number[chosen] = np.arange(len(chosen), dtype=np.int32)
    kept = _within(pairs, number)
    first, second = number[pairs.first[kept]], number[pairs.second[kept]]
    affinity = Affinity(first, second, pairs.separation[kept], pairs.agreement[kept], len(chosen), pairs.spacing)
    return replace(state, centers=state.centers[chosen], before=state.before[chosen], affinity=affinity, cells=cells, active=None)


def _merged(last: TrackedFrame, chosen: np.ndarray, moved: TrackedFrame) -> TrackedFrame:
    """The state after some of its centers have moved on."""
    centers, number = last.centers.copy(), np.full(len(last.centers), -1)
    centers[chosen], number[chosen] = moved.centers, np.arange(len(chosen))
    kept = _within(last.affinity, number)
    separation, agreement = last.affinity.separation.copy(), last.affinity.agreement.copy()
    separation[kept], agreement[kept] = moved.affinity.separation, moved.affinity.agreement
    affinity = replace(last.affinity, separation=separation, agreement=agreement)
    cells = _spread_out(moved.cells, chosen, centers)
    return replace(moved, centers=centers, before=last.centers, affinity=affinity, cells=cells, active=last.active)


def _within(pairs: Affinity, number: np.ndarray) -> np.ndarray:
    return (number[pairs.first] >= 0) & (number[pairs.second] >= 0)


def _joined(old: Affinity, new: Affinity, count: int) -> Affinity:
    """The pairs of both.  count : of all centers."""
    arrays = {name: np.concatenate([getattr(one, name) for one in (old, new)]) for name in ("first", "second", "separation", "agreement")}
    return Affinity(**arrays, centers=count, spacing=old.spacing)


def _spread_out(cells: Cells, chosen: np.ndarray, centers: np.ndarray) -> Cells:
    """The cells of chosen centers among all; retired ones own nothing."""
    masses, centroids, second = np.zeros(len(centers)), centers.copy(), np.zeros((len(centers), 3, 3))
    masses[chosen], centroids[chosen], second[chosen] = cells.masses, cells.centroids, cells.second
    return Cells(masses, centroids, second, cells.energy)
