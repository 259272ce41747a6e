"""Which frames share a reference mesh, as indices into the sequence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.errors import RefMeshError
from ...core.reference.grouping import content_groups
from ...io.frame_range import format_ranges
from ..session.context import Context
from .tracking_result import TrackingResult

# Share of the centers of a run of an open take that each of its frames sees, at least: the rest of its mesh is out of view there.
SEEN = 0.5


@dataclass(frozen=True)
class FrameGroup:
    """Frames that share a reference mesh.

    frames : indices into the sequence.  handover : the next group's first frame, which this group's mesh is carried to as well, or
    None for the last group.  key : of all results that depend on the frames in `source`.
    source : those that the mesh is made from; other groups may have the same mesh.
    segment : whether it is a run that may be far longer than a group of the method.  folder : in the cache, "" or "NAME/".
    """

    index: int
    frames: tuple[int, ...]
    handover: int | None
    key: str
    source: tuple[int, ...]
    segment: bool = False
    folder: str = ""

    @property
    def reached(self) -> tuple[int, ...]:
        """All frames that the group's mesh is carried to."""
        return self.frames if self.handover is None else (*self.frames, self.handover)


def fixed_groups(context: Context) -> list[tuple[int, ...]]:
    """Groups that begin where the settings say, or of the requested size.

    Raises RefMeshError when they are to be chosen by what only tracking shows, and for a start that is not a frame.
    """
    size, count = context.settings.reference.group_size, len(context.frames)
    if context.settings.reference.group_starts.strip():
        starts = _starts(context)
        return [tuple(range(start, end)) for start, end in zip(starts, [*starts[1:], count], strict=True)]
    if not size:
        raise RefMeshError("--group-size auto chooses groups by the tracked centers: give a number, or track with --tracking sequence")
    return [tuple(range(start, min(start + size, count))) for start in range(0, count, size)]


def chosen_groups(context: Context, tracking: TrackingResult) -> list[tuple[int, ...]]:
    """Groups of the requested size, or chosen by content; they end where centers are born or retired."""
    settings = context.settings.reference
    if settings.group_size or settings.group_starts.strip():
        return divided(fixed_groups(context), tuple(sorted({*tracking.changes, *context.cuts})))
    if context.frames.take is not None:
        return groups_of_views(tracking, settings.longest_group)
    (whole,) = tracking.ranges
    cuts = tuple(sorted({*tracking.jumps, *tracking.changes, *context.cuts}))
    return content_groups(tracking.positions, whole.load_affinity(), whole.spacing, settings.longest_group, cuts)


def groups_of_views(tracking: TrackingResult, longest: int) -> list[tuple[int, ...]]:
    """Groups of an open take by content, of frames that see much the same."""
    (whole,), groups = tracking.ranges, []
    for run in similar_views(tracking):
        own = content_groups(tracking.centers_in(run), tracking.affinity_at(run), whole.spacing, longest)
        groups += [tuple(run[row] for row in group) for group in own]
    return groups


def similar_views(tracking: TrackingResult) -> list[tuple[int, ...]]:
    """Runs of frames, as long as each frame of a run sees at least SEEN of the centers that any of them sees."""
    if tracking.active is None:
        return [tuple(range(len(tracking.positions)))]
    runs: list[tuple[int, ...]] = [()]
    together, fewest = np.zeros(tracking.active.shape[1], dtype=bool), 0
    for frame, seen in enumerate(tracking.active):
        together, fewest = together | seen, min(fewest, np.count_nonzero(seen)) if runs[-1] else np.count_nonzero(seen)
        if runs[-1] and fewest < SEEN * np.count_nonzero(together):
            runs.append(())
            together, fewest = seen, np.count_nonzero(seen)
        runs[-1] += (frame,)
    return runs


def divided(runs: list[tuple[int, ...]], at: tuple[int, ...]) -> list[tuple[int, ...]]:
    """The runs of frames, each cut before every frame of `at` that lies within it."""
    parts = []
    for run in runs:
        starts = [run[0], *(frame for frame in at if run[0] < frame <= run[-1])]
        ends = [*starts[1:], run[-1] + 1]
        parts += [tuple(range(start, end)) for start, end in zip(starts, ends, strict=True)]
    return parts


def _starts(context: Context) -> list[int]:
    """Indices of the frames that begin a group; the first frame always does, and instead of a bad frame the one after."""
    numbers, after = list(context.numbers), {bad.frame: bad.after for bad in context.left_out.frames}
    text = context.settings.reference.group_starts
    starts = {0}
    for number in text.split(","):
        if not number.strip().isdecimal() or int(number) not in {*numbers, *after}:
            raise RefMeshError(f"--group-starts '{text}': '{number.strip()}' is not a frame of the job, which has {format_ranges(numbers)}")
        starts.add(numbers.index(after.get(int(number), int(number))))
    return sorted(starts)
