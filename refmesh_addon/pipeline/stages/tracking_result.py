"""The result of tracking, over the whole sequence or group by group."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated

import numpy as np
from scipy import sparse

from ...core.errors import RefMeshError
from ...core.tracking.forward import TrackedFrame
from ...core.tracking.volume import Volume
from ...core.types import FrozenArrays

VOLUME_JUMP = 0.15  # share by which the volume may change from frame to frame without a warning


@dataclass(frozen=True)
class TrackedFrames(FrozenArrays):
    """Frames as they were tracked, one row each.

    centers : (F, C, 3) scene units.  dfu : (F,) standard deviation over mean of the voxels per center.
    lloyd_energy, arap_energy : (F,) in s^2.  steps : (F,) taken until the centers came to rest.
    volume : (F,) enclosed, scene units cubed.  outside : (F,) share of the centers that lie outside the surface.
    active : (F, C) bool, which centers there are; the others are where they are first, or were last.
    """

    centers: Annotated[np.ndarray, "(F, C, 3) float64"]
    dfu: Annotated[np.ndarray, "(F) float64"]
    lloyd_energy: Annotated[np.ndarray, "(F) float64"]
    arap_energy: Annotated[np.ndarray, "(F) float64"]
    steps: Annotated[np.ndarray, "(F) integer"]
    volume: Annotated[np.ndarray, "(F) float64"]
    outside: Annotated[np.ndarray, "(F) float64"]
    active: Annotated[np.ndarray, "(F, C) bool"]

    @classmethod
    def of(cls, state: TrackedFrame, volume: Volume, path: object) -> TrackedFrames:
        """One frame. Raises RefMeshError, naming the file, when the centers were lost."""
        if not np.isfinite(state.centers).all():
            raise RefMeshError(f"{path}: the centers were lost here; leave this frame out with --frames")
        outside = np.mean(volume.finest.tree.query(state.centers[state.active_centers])[0] > volume.finest.spacing)
        values = (state.centers, state.dfu, state.lloyd_energy, state.arap_energy, state.steps, volume.size, outside, state.active_centers)
        return cls(*(np.asarray(value)[None] for value in values))

    @classmethod
    def concatenated(cls, parts: Sequence[TrackedFrames]) -> TrackedFrames:
        """The frames of all parts, one after the other; centers that are born in a later one are added to those before."""
        padded, count = [], max(part.centers.shape[1] for part in parts)
        for part in reversed(parts):
            born = count - part.centers.shape[1]
            if born:
                places = np.broadcast_to(padded[-1].centers[0, -born:], (len(part.centers), born, 3))
                centers = np.concatenate([part.centers, places], axis=1)
                part = replace(part, centers=centers, active=np.pad(part.active, ((0, 0), (0, born))))
            padded.append(part)
        return cls(*(np.concatenate([getattr(part, item.name) for part in reversed(padded)]) for item in fields(cls)))

    def renumbered(self, count: int, order: np.ndarray) -> TrackedFrames:
        """The first `count` frames, with center order[i] in place of center i.  order : (C,) int."""
        first = {item.name: getattr(self, item.name)[:count] for item in fields(self)}
        return TrackedFrames(**{**first, "centers": self.centers[:count, order], "active": self.active[:count, order]})

    @property
    def born(self) -> np.ndarray:
        """(F,) how many centers are there for the first time."""
        return np.append(0, (self.active[1:] & ~self.active[:-1]).sum(axis=1))

    @property
    def retired(self) -> np.ndarray:
        """(F,) how many centers are no longer there."""
        return np.append(0, (~self.active[1:] & self.active[:-1]).sum(axis=1))

    def volume_jumps(self) -> dict[int, float]:
        """Row of each frame that encloses far more or less volume than the one before -> how much, as a share."""
        changes = self.volume[1:] / self.volume[:-1] - 1
        return {int(index) + 1: float(changes[index]) for index in np.flatnonzero(np.abs(changes) > VOLUME_JUMP)}


@dataclass(frozen=True)
class TrackedRange:
    """Frames that were tracked in one go.

    stop : index after the last frame.  spacing : s, scene units.  key : of all this.
    load_affinity : gives the (C, C) weights after the last frame; those of all ranges together might not fit in memory.
    beyond : (C, 3) its centers in the frame after the last, None where that is not known or there is none.
    """

    stop: int
    spacing: float
    key: str
    load_affinity: Callable[[], sparse.csr_matrix]
    beyond: np.ndarray | None = None


@dataclass(frozen=True)
class TrackingResult:
    """positions : (F, C, 3).  ranges : in order, all frames together.  jumps : frames in which something appeared or left, by index.
    active : (F, C) bool, which centers there are; None where all are there in all frames.
    carried : whether the others have places as well, out of view, so that frames with different centers may share a mesh.
    moving : (C,) number of the body of each center, where some are shown apart by their motion only; otherwise None.
    """

    positions: np.ndarray
    ranges: tuple[TrackedRange, ...]
    jumps: tuple[int, ...] = ()
    active: np.ndarray | None = None
    moving: np.ndarray | None = None
    carried: bool = False

    @property
    def changes(self) -> tuple[int, ...]:
        """Frames, by index, in which bodies come or are no longer there: no mesh serves both sides."""
        if self.active is None or self.carried:
            return ()
        return tuple((np.flatnonzero((self.active[1:] != self.active[:-1]).any(axis=1)) + 1).tolist())

    def members(self, frames: tuple[int, ...]) -> np.ndarray:
        """(N,) indices of the centers of a run of frames: those of its first, or if they are carried, of any of them."""
        if self.active is None:
            return np.arange(self.positions.shape[1])
        return np.flatnonzero(self.active[list(frames)].any(axis=0) if self.carried else self.active[frames[0]])

    def affinity_at(self, frames: tuple[int, ...]) -> sparse.csr_matrix:
        """Affinities among the members of a run, after the last frame of its range."""
        affinity, members = self.range_of(frames[0]).load_affinity(), self.members(frames)
        return affinity if self.active is None else affinity[members][:, members].tocsr()

    def range_of(self, index: int) -> TrackedRange:
        """The range that holds a frame, by its index."""
        return next(one for one in self.ranges if index < one.stop)

    def centers_in(self, frames: tuple[int, ...], run: tuple[int, ...] | None = None) -> np.ndarray:
        """(F, C, 3) centers in the frames, as the range that holds the first has tracked them; the one beyond it can only be last.

        They are the members of a run, None for that of the frames; those that are no longer there stay where they were.
        """
        run = run or frames
        own = self.range_of(run[0])
        within = [self.positions[frame] for frame in frames if frame < own.stop]
        beyond = [own.beyond for frame in frames if frame == own.stop and own.beyond is not None]
        return np.stack(within + beyond)[:, self.members(run)]
