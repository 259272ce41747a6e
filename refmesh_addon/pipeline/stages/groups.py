"""Which frames share a reference mesh, as indices into the sequence."""

from __future__ import annotations

from ...core.errors import RefMeshError
from ...core.reference.grouping import content_groups
from ...io.frame_range import format_ranges
from ..session.context import Context
from .tracking_result import Tracked


def fixed_spans(context: Context) -> list[tuple[int, ...]]:
    """Groups that begin where asked, or of the size asked for.

    Raises RefMeshError when they are to be chosen by what only tracking shows, and for a start that is no frame.
    """
    size, count = context.settings.reference.group_size, len(context.frames)
    if context.settings.reference.group_starts.strip():
        starts = _starts(context)
        return [tuple(range(start, end)) for start, end in zip(starts, [*starts[1:], count], strict=True)]
    if not size:
        raise RefMeshError("--group-size auto chooses groups by the tracked centers: give a number, or track with --tracking sequence")
    return [tuple(range(start, min(start + size, count))) for start in range(0, count, size)]


def group_spans(context: Context, tracked: Tracked) -> list[tuple[int, ...]]:
    """Groups of the size asked for, or chosen by content."""
    settings = context.settings.reference
    if settings.group_size or settings.group_starts.strip():
        return fixed_spans(context)
    (part,) = tracked.parts
    return content_groups(tracked.positions, part.affinity, part.spacing, settings.longest_group, tracked.jumps)


def _starts(context: Context) -> list[int]:
    """Indices of the frames that begin a group; the first frame always does."""
    numbers = list(context.numbers)
    words = context.settings.reference.group_starts
    starts = {0}
    for word in words.split(","):
        if not word.strip().isdecimal() or int(word) not in numbers:
            raise RefMeshError(f"--group-starts '{words}': '{word.strip()}' is no frame of the job; it has {format_ranges(numbers)}")
        starts.add(numbers.index(int(word)))
    return sorted(starts)
