"""The tracking stage: frame after frame, with a checkpoint after each."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..core.affinity import Affinity
from ..core.check import RefMeshError
from ..core.lloyd import Cells
from ..core.tracking import TrackedFrame, first_frame, next_frame
from ..core.volume import Volume, sample_volume
from ..io.files import output_folder, write_npz
from ..io.pc2 import write_pc2
from ..io.sequence import held_frames
from .cache import KEY_LENGTH, digest
from .context import READING_SHARE, Context
from .parallel import one_ahead

TRACKING_SCHEMA = 4
VOLUME_JUMP = 0.15  # share by which the volume may change from frame to frame before it is worth a word
OUTSIDE_SHARE = 0.02  # of the centers; a few always lie in the hollow of a bent part
FORWARD_SHARE = 0.5  # of the tracking stage's time, roughly, where rounds of global optimisation follow
STATE = "tracking/state"  # all that the next frame needs; only that of the last frame is kept


@dataclass(frozen=True)
class Tracked:
    """positions : (F, C, 3).  affinity : (C, C) weights after the last frame.  spacing : s.  key : of all this."""

    positions: np.ndarray
    affinity: sparse.csr_matrix
    spacing: float
    key: str


def track(context: Context) -> Tracked:
    """Tracks the centers forward through all frames."""
    settings = context.settings.tracking
    end = FORWARD_SHARE if settings.global_rounds else 1.0
    keys = _chained_keys(context)
    states, done = _resumed(context, keys)
    for index, volume in enumerate(one_ahead(lambda index: volume_of(context, index), range(done, len(keys))), done):
        context.notify("tracking", context.numbers[index], READING_SHARE + (end - READING_SHARE) * index / len(keys))
        state = next_frame(states[-1], volume, settings) if states else first_frame(volume, settings)
        states = [*states[-1:], state]
        context.cache.save(_frame_entry(context, index), keys[index], _entry(context, index, state, volume))
        context.cache.save(STATE, keys[index], _as_arrays(state))
    return _finished(context, keys, states[-1])


def volume_of(context: Context, index: int) -> Volume:
    """The volume of a frame by its index. Raises RefMeshError, naming the file, when there is too little of it."""
    settings = context.settings.tracking
    try:
        return sample_volume(context.frames.body(index), settings.resolution, settings.centers)
    except ValueError as error:
        raise RefMeshError(f"{context.frames.path(index)}: too little volume to track ({error}); RefMesh needs closed bodies") from error


def _entry(context: Context, index: int, state: TrackedFrame, volume: Volume) -> dict[str, np.ndarray]:
    """What is kept of a frame: its centers and figures. Raises RefMeshError, naming the file, when the centers were lost."""
    if not np.isfinite(state.centers).all():
        raise RefMeshError(f"{context.frames.path(index)}: the centers were lost here; leave this frame out with --frames")
    outside = np.mean(cKDTree(volume.finest.positions).query(state.centers)[0] > volume.finest.spacing)
    return _figures(state) | {"centers": state.centers, "volume": np.float64(volume.size), "outside": outside}


def _warn(context: Context, entries: list[dict[str, np.ndarray]]) -> None:
    """Names frames in which something came or went, and those in which centers ended outside."""
    volumes = [float(entry["volume"]) for entry in entries]
    for number, before, volume, entry in zip(context.numbers, volumes[:1] + volumes, volumes, entries, strict=False):
        if abs(volume / before - 1) > VOLUME_JUMP:
            more, what = ("more", "appeared") if volume > before else ("less", "is missing")
            change = f"encloses {abs(volume / before - 1):.0%} {more} volume than the frame before"
            context.warn(f"frame {number}: {change}: something {what}, and centers move to even that out")
        if entry["outside"] > OUTSIDE_SHARE:
            share = float(entry["outside"])
            context.warn(f"frame {number}: {share:.1%} of the centers lie outside the surface; more --centers follow thin parts better")


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


def _figures(state: TrackedFrame) -> dict[str, np.ndarray]:
    return {name: np.float64(getattr(state, name)) for name in ("dfu", "lloyd_energy", "arap_energy", "steps")}


def _as_arrays(state: TrackedFrame) -> dict[str, np.ndarray]:
    parts = {f"{part}_{name}": np.asarray(value) for part in ("affinity", "cells") for name, value in vars(getattr(state, part)).items()}
    numbers = {"arap_energy": np.float64(state.arap_energy), "steps": np.int64(state.steps)}
    return {"centers": state.centers, "before": state.before} | numbers | parts


def _from_arrays(arrays: dict[str, np.ndarray]) -> TrackedFrame:
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


def _finished(context: Context, keys: list[str], last: TrackedFrame) -> Tracked:
    entries = [context.cache.load(_frame_entry(context, index), key) for index, key in enumerate(keys)]
    positions = np.stack([entry["centers"] for entry in entries])
    for name in ("dfu", "lloyd_energy", "arap_energy"):
        context.report.tracking[name] = [float(entry[name]) for entry in entries]
    context.report.tracking["center_spacing"] = last.affinity.spacing
    _warn(context, entries)
    return Tracked(positions, last.affinity.weights(), last.affinity.spacing, keys[-1])


def write_tracked(context: Context, tracked: Tracked) -> None:
    """centers.npz and the playback of the centers."""
    write_centers(context, tracked.positions, {})
    _write_playback(context, tracked.positions, tracked.key)


def write_centers(context: Context, positions: np.ndarray, reference_centers: dict[str, np.ndarray]) -> None:
    """centers.npz, with the arrays of the groups where they are known."""
    write_npz(context.output / "centers.npz", {"frames": np.array(context.numbers), "positions": positions, **reference_centers})


def _write_playback(context: Context, positions: np.ndarray, key: str) -> None:
    output_folder(context.output / "playback")
    path = f"playback/centers-{key[:KEY_LENGTH]}.pc2"
    shown = held_frames(context.frames.sequence)
    write_pc2(context.output / path, (positions[index] for index in shown), positions.shape[1], len(shown))
    context.report.centers_playback = path
    context.remove_stale("playback/centers-*.pc2", keep=[path])
