"""The tracking stage: centers carried through all frames, over the whole sequence or group by group."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from ...core.errors import RefMeshError
from ...core.settings import TrackingSettings
from ...core.tracking.affinity import Affinity
from ...core.tracking.forward import TrackedFrame, first_frame, next_frame
from ...core.tracking.lloyd import Cells
from ...core.tracking.volume import Volume, sample_volume
from ...core.types import TriangleMesh
from ..session.cache import Arrays, digest
from ..session.context import READING_SHARE, Context
from ..session.parallel import one_ahead
from .tracking_result import Part, Tracked, frame_entry, report_tracking, volume_jumps

TRACKING_SCHEMA = 5
FORWARD_SHARE = 0.5  # of the tracking stage's time, roughly, where rounds of global optimisation follow
STATE = "tracking/state"  # all that the next frame needs; only that of the last frame is kept


def track_sequence(context: Context) -> Tracked:
    """Tracks the centers forward through all frames."""
    settings = context.settings.tracking
    end = FORWARD_SHARE if settings.global_rounds else 1.0
    keys = _chained_keys(context)
    states, done = _resumed(context, keys)
    for index, volume in enumerate(one_ahead(lambda index: volume_of(context, index), range(done, len(keys))), done):
        context.notify("tracking", context.numbers[index], READING_SHARE + (end - READING_SHARE) * index / len(keys))
        state = next_frame(states[-1], volume, settings) if states else first_frame(volume, settings)
        states = [*states[-1:], state]
        context.cache.save(_frame_entry(context, index), keys[index], frame_entry(state, volume, context.frames.path(index)))
        context.cache.save(STATE, keys[index], _as_arrays(state))
    entries = [context.cache.load(_frame_entry(context, index), key) for index, key in enumerate(keys)]
    affinity = states[-1].affinity
    report_tracking(context, entries, affinity.spacing)
    part = Part(len(keys), affinity.weights(), affinity.spacing, keys[-1])
    return Tracked(np.stack([entry["centers"] for entry in entries]), (part,), tuple(volume_jumps(entries)))


def volume_of(context: Context, index: int) -> Volume:
    """The volume of a frame by its index. Raises RefMeshError, naming the file, when there is too little of it."""
    return enclosed_volume(context.frames.body(index), context.frames.path(index), context.settings.tracking)


def enclosed_volume(body: TriangleMesh, path: Path, settings: TrackingSettings) -> Volume:
    """The volume of a frame. Raises RefMeshError, naming the file, when there is too little of it."""
    try:
        return sample_volume(body, settings.resolution, settings.centers)
    except ValueError as error:
        raise RefMeshError(f"{path}: too little volume to track ({error}); RefMesh needs closed bodies") from error


def _chained_keys(context: Context) -> list[str]:
    """Each frame's result depends on the settings of the forward pass and on all frames up to it."""
    settings = asdict(context.settings.tracking)
    del settings["global_rounds"]
    key, keys = digest(TRACKING_SCHEMA, settings), []
    for frame_key in context.frames.keys:
        key = digest(key, frame_key)
        keys.append(key)
    return keys


def _frame_entry(context: Context, index: int) -> str:
    return f"tracking/frame_{context.numbers[index]:04d}"


def _resumed(context: Context, keys: list[str]) -> tuple[list[TrackedFrame], int]:
    """The last state on disk, if any, and how many frames are done."""
    for done in range(len(keys), 0, -1):
        state = context.cache.load(STATE, keys[done - 1])
        if state is not None:
            complete = all(context.cache.load(_frame_entry(context, i), keys[i]) is not None for i in range(done))
            return ([_from_arrays(state)], done) if complete else ([], 0)
    return [], 0


def _as_arrays(state: TrackedFrame) -> Arrays:
    parts = {f"{part}_{name}": np.asarray(value) for part in ("affinity", "cells") for name, value in vars(getattr(state, part)).items()}
    numbers = {"arap_energy": np.float64(state.arap_energy), "steps": np.int64(state.steps)}
    return {"centers": state.centers, "before": state.before} | numbers | parts


def _from_arrays(arrays: Arrays) -> TrackedFrame:
    within = lambda part: {name.removeprefix(part): value for name, value in arrays.items() if name.startswith(part)}
    affinity, cells = within("affinity_"), within("cells_")
    return TrackedFrame(
        arrays["centers"],
        arrays["before"],
        Affinity(**{**affinity, "centers": int(affinity["centers"]), "spacing": float(affinity["spacing"])}),
        Cells(**{**cells, "energy": float(cells["energy"])}),
        float(arrays["arap_energy"]),
        int(arrays["steps"]),
    )
