"""Which vertices each frame of an open take shows: one unit of work per frame, done after the deformation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...core.evaluation.shown_surface import VisibleVertices, median_of_three, shown_vertices
from ...io.visibility_sheet import write_visibility
from ..session.cache import KEY_LENGTH, digest
from ..session.cached_map import WorkUnit, cached_map
from ..session.context import Context
from ..session.job import DEFORMATION
from ..session.stage_share import StageShare
from .deformation import DeformedSequence
from .groups import FrameGroup

VISIBILITY_SCHEMA = 4
SHEET_SCHEMA = 2
SHARE = StageShare(DEFORMATION, 0.98, 1.0)


def visible_vertices(context: Context, deformed: DeformedSequence) -> Mapping[int, VisibleVertices]:
    """Of each frame, by index; empty for a take of closed bodies."""
    if context.frames.take is None:
        return {}
    units = {frame: _unit(context, deformed, group, frame) for group in deformed.groups for frame in group.frames}
    return cached_map(context, shown_vertices, units, VisibleVertices, SHARE)


def steady_visibility(visible: Mapping[int, VisibleVertices], group: FrameGroup, row: int) -> np.ndarray:
    """(R,) visibility in a frame of a group as it is played and written: what changes for this frame only does not.

    visible : from `visible_vertices`, by which distances are measured.  row : of the frame in the group.
    """
    around = [visible[frame].visibility for frame in group.frames[max(row - 1, 0) : row + 2]]
    return median_of_three(*around) if len(around) == 3 else visible[group.frames[row]].visibility


def write_visibility_sheets(context: Context, deformed: DeformedSequence) -> None:
    """The picture of each group from which Blender knows what each scene frame shows; none for closed takes."""
    visible = visible_vertices(context, deformed)
    for group in deformed.groups if visible else ():
        path = f"playback/visibility_{group.index:03d}-{digest(SHEET_SCHEMA, VISIBILITY_SCHEMA, group.key)[:KEY_LENGTH]}.png"
        shown = [group.frames.index(frame) for frame in context.shown if frame in group.frames]
        count = len(deformed.references[group.index].mesh.vertices)
        write_visibility(context.claim(path), (steady_visibility(visible, group, row) for row in shown), count, len(shown))
        context.report.groups[group.index] = replace(context.report.groups[group.index], visibility=path)
    kept = [group.visibility for group in context.report.groups if group.visibility]
    context.remove_stale("playback/visibility_*.png", keep=kept)


def _unit(context: Context, deformed: DeformedSequence, group: FrameGroup, frame: int) -> WorkUnit:
    number = context.numbers[frame]
    key = digest(VISIBILITY_SCHEMA, context.frames.keys[frame], deformed.frame_key(group, frame), number)
    arguments = lambda: (deformed.mesh(group, frame), context.frames.surface(frame))
    return WorkUnit(f"{group.folder}deformation/visibility_{number:04d}", key, arguments, number)
