"""Which frames share a reference mesh, as indices into the sequence."""

from __future__ import annotations

from ..core.check import RefMeshError
from ..core.grouping import content_groups
from .context import Context
from .tracked import Tracked


def fixed_spans(context: Context) -> list[tuple[int, ...]]:
    """Groups of the size asked for. Raises RefMeshError when they are to be chosen by what only tracking shows."""
    size, count = context.settings.reference.group_size, len(context.frames)
    if not size:
        raise RefMeshError("--group-size auto chooses groups by the tracked centers: give a number, or track with --tracking sequence")
    return [tuple(range(start, min(start + size, count))) for start in range(0, count, size)]


def group_spans(context: Context, tracked: Tracked) -> list[tuple[int, ...]]:
    """Groups of the size asked for, or chosen by content."""
    settings = context.settings.reference
    if settings.group_size:
        return fixed_spans(context)
    (part,) = tracked.parts
    return content_groups(tracked.positions, part.affinity, part.spacing, settings.longest_group, tracked.jumps)
