"""What tracking leaves, whichever way it went: centers in every frame, how they hang together, figures and files."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ...core.errors import RefMeshError
from ...core.tracking.center_attributes import center_attributes
from ...core.tracking.forward import TrackedFrame
from ...core.tracking.volume import Volume
from ...io.files import CENTERS_NAME, output_folder, write_npz
from ...io.pc2 import write_pc2
from ...io.sequence import held_frames
from ..session.cache import KEY_LENGTH, Arrays, digest
from ..session.context import Context

VOLUME_JUMP = 0.15  # share by which the volume may change from frame to frame before it is worth a word
OUTSIDE_SHARE = 0.02  # of the centers; a few always lie in the hollow of a bent part
CENTER_ATTRIBUTES_SCHEMA = 1
FRAME_FIGURES = ("dfu", "lloyd_energy", "arap_energy", "steps")  # of each frame


@dataclass(frozen=True)
class Part:
    """Frames tracked in one go.

    stop : index after the last frame.  affinity : (C, C) weights after the last frame.  spacing : s.  key : of all this.
    beyond : (C, 3) its centers in the frame after the last, None where that is not known or there is none.
    """

    stop: int
    affinity: sparse.csr_matrix
    spacing: float
    key: str
    beyond: np.ndarray | None = None


@dataclass(frozen=True)
class Tracked:
    """positions : (F, C, 3).  parts : in order, all frames together.  jumps : frames in which something appeared or left, by index."""

    positions: np.ndarray
    parts: tuple[Part, ...]
    jumps: tuple[int, ...] = ()

    def part_of(self, index: int) -> Part:
        """The part that holds a frame, by its index."""
        return next(part for part in self.parts if index < part.stop)

    def seen(self, frames: tuple[int, ...]) -> np.ndarray:
        """(F, C, 3) centers in the frames, as the part that holds the first of them has tracked them."""
        part = self.part_of(frames[0])
        return np.stack([self.positions[frame] if frame < part.stop else part.beyond for frame in frames])


def frame_entry(state: TrackedFrame, volume: Volume, path: object) -> Arrays:
    """What is kept of a frame: its centers and figures. Raises RefMeshError, naming the file, when the centers were lost."""
    if not np.isfinite(state.centers).all():
        raise RefMeshError(f"{path}: the centers were lost here; leave this frame out with --frames")
    outside = np.mean(cKDTree(volume.finest.positions).query(state.centers)[0] > volume.finest.spacing)
    figures = {name: np.float64(getattr(state, name)) for name in FRAME_FIGURES}
    return figures | {"centers": state.centers, "volume": np.float64(volume.size), "outside": outside}


def volume_jumps(entries: list[Arrays]) -> dict[int, float]:
    """Index of each frame that encloses far more or less volume than the one before -> how much, as a share."""
    volumes = np.array([float(entry["volume"]) for entry in entries])
    changes = volumes[1:] / volumes[:-1] - 1
    return {int(index) + 1: float(changes[index]) for index in np.flatnonzero(np.abs(changes) > VOLUME_JUMP)}


def report_tracking(context: Context, entries: list[Arrays], spacing: float) -> None:
    """Puts the figures of all frames into the report, and says which frames are doubtful."""
    for name in ("dfu", "lloyd_energy", "arap_energy"):
        context.report.tracking[name] = [float(entry[name]) for entry in entries]
    context.report.tracking["center_spacing"] = spacing
    _warn(context, entries)


def _warn(context: Context, entries: list[Arrays]) -> None:
    """Names frames in which something came or went, and those in which centers ended outside."""
    jumps = volume_jumps(entries)
    for index, (number, entry) in enumerate(zip(context.numbers, entries, strict=False)):
        if index in jumps:
            more, what = ("more", "appeared") if jumps[index] > 0 else ("less", "is missing")
            change = f"encloses {abs(jumps[index]):.0%} {more} volume than the frame before"
            context.warn(f"frame {number}: {change}: something {what}, and centers move to even that out")
        if entry["outside"] > OUTSIDE_SHARE:
            share = float(entry["outside"])
            context.warn(f"frame {number}: {share:.1%} of the centers lie outside the surface; more --centers follow thin parts better")


def write_tracked(context: Context, tracked: Tracked) -> None:
    """centers.npz and the playback of the centers."""
    write_centers(context, tracked, {})
    _write_playback(context, tracked.positions, digest(*(part.key for part in tracked.parts)))


def write_centers(context: Context, tracked: Tracked, reference_centers: dict[str, np.ndarray], bodies: np.ndarray | None = None) -> None:
    """centers.npz: positions, the figures by which a person looks at them, and the arrays of the groups where they are known.

    bodies : (C,) that must be apart, or None.
    """
    spacing = context.report.tracking["center_spacing"]
    entry, marked = ("tracking/figures", []) if bodies is None else ("reference/figures", bodies.tolist())
    key = digest(CENTER_ATTRIBUTES_SCHEMA, [part.key for part in tracked.parts], marked)
    figures = context.cache.load_or_make(entry, key, lambda: center_attributes(tracked.positions, spacing, bodies))
    centers = {"frames": np.array(context.numbers), "positions": tracked.positions}
    write_npz(context.output / CENTERS_NAME, {**centers, **figures, **reference_centers})


def _write_playback(context: Context, positions: np.ndarray, key: str) -> None:
    output_folder(context.output / "playback")
    path = f"playback/centers-{key[:KEY_LENGTH]}.pc2"
    shown = held_frames(context.frames.sequence)
    write_pc2(context.output / path, (positions[index] for index in shown), positions.shape[1], len(shown))
    context.report.centers_playback = path
    context.remove_stale("playback/centers-*.pc2", keep=[path])
