"""The tracking stage over a whole sequence: centers carried forward from frame to frame."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np

from ...core.errors import RefMeshError
from ...core.settings import TrackingSettings
from ...core.tracking.forward import TrackedFrame, first_frame
from ...core.tracking.out_of_view import carried_out_of_view
from ...core.tracking.population import Change, advanced
from ...core.tracking.view_changes import repopulated
from ...core.tracking.volume import Volume, sample_volume
from ...core.types import FrozenArrays, TriangleMesh
from ..session.cache import digest
from ..session.context import READING_SHARE, Context
from ..session.job import TRACKING
from ..session.parallel import one_ahead
from ..session.stage_share import StageShare
from .moving_bodies import report_bodies, take_bodies
from .tracking_report import report_tracking
from .tracking_result import TrackedFrames, TrackedRange, TrackingResult

TRACKING_SCHEMA = 11
VIEW_SCHEMA = 5  # of what is done differently for open takes
FORWARD_SHARE = 0.5  # of the tracking stage's time, roughly, where rounds of global optimization follow
STATE = "state"  # all that the next frame needs; only that of the last frame is kept


@dataclass(frozen=True)
class _Pass:
    """One pass through all frames.  folder : of its entries in the cache.  bodies : (C,) that do not pull on each other, or None.
    share : of the stage's progress.
    """

    folder: str
    bodies: np.ndarray | None
    share: StageShare


@dataclass(frozen=True)
class CarriedCenters(FrozenArrays):
    """positions : (F, C, 3) of centers in view and out of it, scene units."""

    positions: Annotated[np.ndarray, "(F, C, 3) float64"]


def track_sequence(context: Context) -> TrackingResult:
    """Tracks the centers forward through all frames; twice where bodies turn out to be several that touch all the time."""
    end = FORWARD_SHARE if requested_rounds(context) else 1.0
    frames, result = _tracked_through(context, _Pass("tracking/", None, StageShare(TRACKING, READING_SHARE, end)))
    found = take_bodies(context, result)
    if found is not None and found.by_motion.any():  # the time of this is not foreseen
        frames, result = _tracked_through(context, _Pass("tracking/apart_", found.bodies, StageShare(TRACKING, end, end)))
    if found is not None and found.joined.any():
        result = replace(result, moving=found.bodies)
    report_tracking(context, frames, result.ranges[0].spacing)
    if found is not None:
        report_bodies(context, result, found)
    return result


def requested_rounds(context: Context) -> int:
    """Rounds of global optimization that follow; open takes have none, see `global_rounds`."""
    return context.settings.tracking.global_rounds if context.frames.take is None else 0


def _tracked_through(context: Context, own: _Pass) -> tuple[TrackedFrames, TrackingResult]:
    settings, keys, share = context.settings.tracking, _chained_keys(context, own.bodies), own.share
    state, done = _resumed(context, own, keys)
    share.skip(context.notify, done / len(keys))
    for index, volume in enumerate(one_ahead(lambda index: volume_of(context, index), range(done, len(keys))), done):
        share.tell(context.notify, index / len(keys), context.numbers[index])
        state = _followed(context, index, state, volume) if state else _first(volume, settings, own.bodies)
        frame = TrackedFrames.of(state, volume, context.frames.path(index))
        context.cache.save_result(_frame_entry(context, own, index), keys[index], frame)
        context.cache.save_result(own.folder + STATE, keys[index], state)
    assert state is not None, "a sequence has at least one frame"
    return _result(context, own, keys, state)


def _first(volume: Volume, settings: TrackingSettings, bodies: np.ndarray | None) -> TrackedFrame:
    state = first_frame(volume, settings)
    return state if bodies is None else replace(state, affinity=state.affinity.within(bodies))


def _followed(context: Context, index: int, last: TrackedFrame, volume: Volume) -> TrackedFrame:
    """The centers in the next frame; those of a body that has left are retired, and a body that comes gets its own."""
    frames, path, settings = context.frames, context.frames.path(index), context.settings.tracking
    change = Change(
        frames.departure(index - 1) if index - 1 in frames.leaving else None,
        frames.arrival(index) if index in frames.coming else None,
        enclosed_volume(frames.settled(index), path, settings) if index in frames.coming else volume,
        None if index - 1 in frames.leaving else partial(volume_of, context, index - 1),
    )
    try:
        state = advanced(last, volume, change, settings)
        return repopulated(state, volume) if volume.is_view else state
    except ValueError as error:
        raise RefMeshError(f"{path}: too little volume to track in a body that appears here ({error})") from error


def volume_of(context: Context, index: int) -> Volume:
    """The volume of a frame by its index. Raises RefMeshError, naming the file, when there is too little of it."""
    volume = enclosed_volume(context.frames.body(index), context.frames.path(index), context.settings.tracking)
    return replace(volume, is_view=context.frames.take is not None)


def enclosed_volume(body: TriangleMesh, path: Path, settings: TrackingSettings) -> Volume:
    """The volume of a frame. Raises RefMeshError, naming the file, when there is too little of it."""
    try:
        return sample_volume(body, settings.resolution, settings.centers)
    except ValueError as error:
        remedy = "RefMesh needs closed bodies, or surfaces that are seen from the front; --frames leaves this frame out"
        raise RefMeshError(f"{path}: too little volume to track ({error}); {remedy}") from error


def _result(context: Context, own: _Pass, keys: list[str], last: TrackedFrame) -> tuple[TrackedFrames, TrackingResult]:
    frames = TrackedFrames.concatenated([_tracked(context, own, index, key) for index, key in enumerate(keys)])
    affinity = last.affinity
    whole = TrackedRange(len(keys), affinity.spacing, keys[-1], affinity.weights)
    jumps = frames.volume_jumps() if context.frames.take is None else ()  # of an open take, more is seen at one time than at another
    if frames.active.all():
        return frames, TrackingResult(frames.centers, (whole,), tuple(jumps))
    carried = context.frames.take is not None
    positions = _carried(context, own, frames, whole) if carried else frames.centers
    return frames, TrackingResult(positions, (whole,), tuple(jumps), frames.active, carried=carried)


def _carried(context: Context, own: _Pass, frames: TrackedFrames, whole: TrackedRange) -> np.ndarray:
    """(F, C, 3) positions, also of centers out of view."""
    make = lambda: CarriedCenters(carried_out_of_view(frames.centers, frames.active, whole.load_affinity()))
    return context.cache.load_or_make_result(f"{own.folder}carried", digest(whole.key), CarriedCenters, make).positions


def _tracked(context: Context, own: _Pass, index: int, key: str) -> TrackedFrames:
    """A frame that was tracked before, read from the cache. Raises RefMeshError, naming the file, when it is gone."""
    entry = _frame_entry(context, own, index)
    frame = context.cache.load_result(entry, key, TrackedFrames)
    if frame is None:
        raise RefMeshError(f"{context.cache.path(entry, key)}: cannot be read again; start the run again")
    return frame


def _chained_keys(context: Context, bodies: np.ndarray | None) -> list[str]:
    """Each frame's result depends on the settings of the forward pass and on all frames up to it."""
    settings = asdict(context.settings.tracking)
    for name in ("global_rounds", "surface", "bad_frames"):  # the keys of the frames depend on the last two
        del settings[name]
    known = view_schema(context) + ([] if bodies is None else [bodies.tolist()])
    key, keys, frames = digest(TRACKING_SCHEMA, settings, *known), [], context.frames
    for index, frame_key in enumerate(frames.keys):
        changes = [kind[at].tolist() for kind, at in ((frames.leaving, index - 1), (frames.coming, index)) if at in kind]
        key = digest(key, frame_key, *changes)
        keys.append(key)
    return keys


def view_schema(context: Context) -> list[int]:
    """VIEW_SCHEMA where it applies, for keys."""
    return [] if context.frames.take is None else [VIEW_SCHEMA]


def _frame_entry(context: Context, own: _Pass, index: int) -> str:
    return f"{own.folder}frame_{context.numbers[index]:04d}"


def _resumed(context: Context, own: _Pass, keys: list[str]) -> tuple[TrackedFrame | None, int]:
    """The last state on disk, if any, and how many frames are done."""
    for done in range(len(keys), 0, -1):
        state = context.cache.load_result(own.folder + STATE, keys[done - 1], TrackedFrame)
        if state is not None:
            entries = (context.cache.load_result(_frame_entry(context, own, index), keys[index], TrackedFrames) for index in range(done))
            return (state, done) if all(entries) else (None, 0)
    return None, 0
