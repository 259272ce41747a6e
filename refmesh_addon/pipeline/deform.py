"""The deformation stage: each group's reference mesh in each of its frames."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np

from ..core.types import TriangleMesh
from ..io.files import output_folder
from ..io.meshes import write_ply
from ..io.pc2 import write_pc2
from ..io.report import FrameReport
from ..io.sequence import held_frames
from .cache import KEY_LENGTH, digest
from .context import Context
from .deforming import GroupShape, deform_reference
from .refer import Group
from .tracked import Tracked

DEFORMATION_SCHEMA = 2
FLIPPED_WARNING = 0.001  # share of flipped triangles above which a frame is named in the warnings


def deform(context: Context, tracked: Tracked, groups: list[Group]) -> dict[int, TriangleMesh]:
    """Index of frame -> the deformed reference; writes a PLY for each frame and a point cache for each group."""
    settings = context.settings.deformation
    keys = {group.index: digest(DEFORMATION_SCHEMA, group.key, asdict(settings)) for group in groups}
    jobs = [(group, frame) for group in groups for frame in group.frames]
    found = {frame: context.cache.load(_entry(context, frame), keys[group.index]) for group, frame in jobs}
    waiting = [(group, frame) for group, frame in jobs if found[frame] is None]
    shapes = {group.index: GroupShape(keys[group.index], group.mesh, group.centers, settings) for group in groups}
    tasks = ((shapes[group.index], group.targets[frame], context.frames.mesh(frame), tracked.positions[frame]) for group, frame in waiting)
    for count, (index, result) in enumerate(context.workers.map(deform_reference, tasks, lambda: context.notify("deformation", None, 0.0))):
        group, frame = waiting[index]
        found[frame] = result
        context.cache.save(_entry(context, frame), keys[group.index], result)
        context.notify("deformation", context.numbers[frame], (len(jobs) - len(waiting) + count + 1) / len(jobs))
    deformed = {frame: group.mesh.moved(found[frame]["vertices"]) for group, frame in jobs}
    for group in groups:
        _write_frames(context, group, found)
        _write_playback(context, group, deformed, keys[group.index])
    context.remove_stale("deformed/frame_*.ply", keep=[frame.deformed for frame in context.report.frames])
    context.remove_stale("playback/group_*.pc2", keep=[group.playback for group in context.report.groups])
    return deformed


def _entry(context: Context, frame: int) -> str:
    return f"deformation/frame_{context.numbers[frame]:04d}"


def _write_frames(context: Context, group: Group, found: dict[int, dict[str, np.ndarray]]) -> None:
    output_folder(context.output / "deformed")
    for frame in group.frames:
        number = context.numbers[frame]
        flipped, held, hidden = (float(found[frame][name].mean()) for name in ("folded", "held", "hidden"))
        entry = FrameReport(number, group.index, f"deformed/frame_{number:04d}.ply", flipped, held, hidden)
        write_ply(context.output / entry.deformed, group.mesh.moved(found[frame]["vertices"]))
        context.report.frames.append(entry)
        if flipped > FLIPPED_WARNING:
            context.warn(f"frame {number}: {flipped:.2%} of the triangles are flipped; a smaller --group-size may serve it better")


def _write_playback(context: Context, group: Group, deformed: dict[int, TriangleMesh], key: str) -> None:
    playback = f"playback/group_{group.index:03d}-{key[:KEY_LENGTH]}.pc2"
    shown = [frame for frame in held_frames(context.frames.sequence) if frame in group.frames]
    samples = (np.asarray(deformed[frame].vertices) for frame in shown)
    write_pc2(context.output / playback, samples, len(group.mesh.vertices), len(shown))
    context.report.groups[group.index] = replace(context.report.groups[group.index], playback=playback)
