"""The evaluation stage: how far each deformed frame is from its source, in figures and in colour."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np

from ...core.arrays import from_arrays, to_arrays
from ...core.evaluation.error_scale import error_colors
from ...core.evaluation.metrics import MeasuredFrame, measure
from ...core.types import TriangleMesh
from ...io.ply import write_ply
from ..session.cache import digest
from ..session.context import Context
from .deformation import Deformed

EVALUATION_SCHEMA = 4


def evaluate(context: Context, deformed: Deformed) -> None:
    """Fills in the distances of frames and hand-overs in the report and colours each frame's PLY by the error of each vertex."""
    _evaluate_frames(context, deformed.frames, deformed.velocities)
    _evaluate_handovers(context, deformed)


def _evaluate_frames(context: Context, deformed: dict[int, TriangleMesh], velocities: dict[int, np.ndarray]) -> None:
    settings = context.settings.evaluation
    frames = sorted(deformed)
    keys = {
        frame: digest(EVALUATION_SCHEMA, asdict(settings), context.frames.keys[frame], deformed[frame].vertices.tobytes())
        for frame in frames
    }
    found = {frame: context.cache.load(_entry(context, frame), keys[frame]) for frame in frames}
    waiting = [frame for frame in frames if found[frame] is None]
    tasks = ((context.frames.mesh(frame), deformed[frame], settings.samples) for frame in waiting)
    for count, (index, result) in enumerate(context.workers.map(measure, tasks, lambda: context.notify("evaluation", None, 0.0))):
        frame = waiting[index]
        found[frame] = to_arrays(result)
        context.cache.save(_entry(context, frame), keys[frame], found[frame])
        context.notify("evaluation", context.numbers[frame], (len(frames) - len(waiting) + count + 1) / len(frames))
    for position, frame in enumerate(frames):
        entry, measured = context.report.frames[position], from_arrays(MeasuredFrame, found[frame])
        write_ply(context.output / entry.deformed, deformed[frame], error_colors(measured.errors), velocities[frame])
        context.report.frames[position] = replace(entry, **vars(measured.distances))  # its figures have the same names in the report


def _evaluate_handovers(context: Context, deformed: Deformed) -> None:
    """How far each group's mesh lies from that of the next group, in the next one's first frame."""
    tasks = []
    for index in deformed.handovers:
        following = context.numbers.index(context.report.groups[index + 1].frames[0])
        tasks.append((deformed.frames[following], deformed.handovers[index], context.settings.evaluation.samples))
    alive = lambda: context.notify("evaluation", None, 1.0)
    for task, measured in context.workers.map(measure, tasks, alive):
        index = list(deformed.handovers)[task]
        handover = measured.distances.source_to_deformed
        context.report.groups[index] = replace(context.report.groups[index], handover=handover)


def _entry(context: Context, frame: int) -> str:
    return f"evaluation/frame_{context.numbers[frame]:04d}"
