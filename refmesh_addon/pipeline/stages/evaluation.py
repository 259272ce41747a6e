"""The evaluation stage: how far each deformed frame is from its source, and each group's mesh from the next one's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace

from ...core.capture.openness import OPEN
from ...core.evaluation.distances import Distances
from ...core.evaluation.metrics import MeasuredFrame, measure, source_distances
from ...core.evaluation.open_metrics import measure_open
from ...core.evaluation.shown_surface import VisibleVertices
from ..session.cache import digest
from ..session.cached_map import WorkUnit, cached_map
from ..session.context import Context
from ..session.job import EVALUATION
from ..session.stage_share import StageShare
from .deformation import DeformedSequence
from .groups import FrameGroup
from .visibility import VISIBILITY_SCHEMA, visible_vertices

EVALUATION_SCHEMA = 6
OPEN_EVALUATION_SCHEMA = 3
HANDOVER_SCHEMA = 7
# Parts of the stage's time, roughly.
FRAMES = StageShare(EVALUATION, 0.0, 0.85)
HANDOVERS = StageShare(EVALUATION, 0.85, 1.0)


def evaluate(context: Context, deformed: DeformedSequence) -> Mapping[int, MeasuredFrame]:
    """The distances of all frames, by index; those of the hand-overs go into the report."""
    groups, measured = deformed.groups, measure_frames(context, deformed)
    handovers = {group.index: _handover_unit(context, deformed, group) for group in groups[:-1]}
    for index, distance in cached_map(context, source_distances, handovers, Distances, HANDOVERS).items():
        context.report.groups[index] = replace(context.report.groups[index], handover=distance)
    return measured


def measure_frames(context: Context, deformed: DeformedSequence) -> Mapping[int, MeasuredFrame]:
    """The distances of all frames, by index."""
    pairs = [(group, frame) for group in deformed.groups for frame in group.frames]
    if context.frames.take is None:
        units = {frame: _frame_unit(context, deformed, group, frame) for group, frame in pairs}
        return cached_map(context, measure, units, MeasuredFrame, FRAMES)
    visible = visible_vertices(context, deformed)
    units = {frame: _open_unit(context, deformed, group, frame, visible) for group, frame in pairs}
    return cached_map(context, measure_open, units, MeasuredFrame, FRAMES)


def _frame_unit(context: Context, deformed: DeformedSequence, group: FrameGroup, frame: int) -> WorkUnit:
    settings, number = context.settings.evaluation, context.numbers[frame]
    key = digest(EVALUATION_SCHEMA, asdict(settings), context.frames.keys[frame], deformed.frame_key(group, frame), number)
    arguments = lambda: (context.frames.mesh(frame), deformed.mesh(group, frame), settings.samples)
    return WorkUnit(f"{group.folder}evaluation/frame_{number:04d}", key, arguments, number)


def _open_unit(
    context: Context, deformed: DeformedSequence, group: FrameGroup, frame: int, visible: Mapping[int, VisibleVertices]
) -> WorkUnit:
    unit, frames = _frame_unit(context, deformed, group, frame), context.frames
    key = digest(OPEN_EVALUATION_SCHEMA, VISIBILITY_SCHEMA, unit.key)

    def arguments() -> tuple:
        kept, samples = frames.surface(frame), context.settings.evaluation.samples
        return frames.mesh(frame), kept, deformed.mesh(group, frame), visible[frame].visibility, samples, frames.kind == OPEN

    return replace(unit, key=key, arguments=arguments)


def _handover_unit(context: Context, deformed: DeformedSequence, group: FrameGroup) -> WorkUnit:
    """From the next group's mesh to this group's, both in the first frame of the next group."""
    settings, following = context.settings.evaluation, deformed.groups[group.index + 1]
    key = digest(HANDOVER_SCHEMA, asdict(settings), group.key, following.key)
    frame = following.frames[0]
    arguments = lambda: (deformed.mesh(following, frame), deformed.mesh(group, frame), settings.samples)
    return WorkUnit(f"evaluation/handover_{group.index:03d}", key, arguments, context.numbers[frame])
