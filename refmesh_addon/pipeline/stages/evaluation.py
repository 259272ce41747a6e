"""The evaluation stage: how far each deformed frame is from its source, in figures and in colour."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np

from ...core.evaluation.error_scale import error_colors
from ...core.evaluation.metrics import measure
from ...core.types import TriangleMesh
from ...io.ply import write_ply
from ...io.report import Distances
from ..session.cache import digest
from ..session.context import Context
from .deformation import Deformed

EVALUATION_SCHEMA = 3
FIGURES = ("mean", "rms", "p99", "max")
WAYS = ("source_to_deformed", "deformed_to_source", "visible_to_source")


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
        found[frame] = _as_arrays(*result)
        context.cache.save(_entry(context, frame), keys[frame], found[frame])
        context.notify("evaluation", context.numbers[frame], (len(frames) - len(waiting) + count + 1) / len(frames))
    for position, frame in enumerate(frames):
        entry = context.report.frames[position]
        write_ply(context.output / entry.deformed, deformed[frame], error_colors(found[frame]["errors"]), velocities[frame])
        context.report.frames[position] = replace(entry, **_figures(found[frame]))


def _evaluate_handovers(context: Context, deformed: Deformed) -> None:
    """How far each group's mesh lies from that of the next group, in the next one's first frame."""
    tasks = []
    for index in deformed.handovers:
        following = context.numbers.index(context.report.groups[index + 1].frames[0])
        tasks.append((deformed.frames[following], deformed.handovers[index], context.settings.evaluation.samples))
    alive = lambda: context.notify("evaluation", None, 1.0)
    for task, (distance, _) in context.workers.map(measure, tasks, alive):
        index = list(deformed.handovers)[task]
        handover = Distances(**asdict(distance.source_to_deformed))
        context.report.groups[index] = replace(context.report.groups[index], handover=handover)


def _entry(context: Context, frame: int) -> str:
    return f"evaluation/frame_{context.numbers[frame]:04d}"


def _as_arrays(distance, errors: np.ndarray) -> dict[str, np.ndarray]:
    ways = {name: np.array([getattr(getattr(distance, name), figure) for figure in FIGURES]) for name in WAYS}
    return ways | {"unseen": np.float64(distance.unseen), "psnr": np.array([distance.d1_psnr, distance.d2_psnr]), "errors": errors}


def _figures(arrays: dict[str, np.ndarray]) -> dict[str, object]:
    ways = {name: Distances(*arrays[name].tolist()) for name in WAYS}
    d1, d2 = arrays["psnr"].tolist()
    return {**ways, "unseen": float(arrays["unseen"]), "d1_psnr": d1, "d2_psnr": d2}
