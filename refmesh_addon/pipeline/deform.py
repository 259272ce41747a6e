"""The deformation stage: each group's reference mesh in each of its frames."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from ..core.types import TriangleMesh
from ..io.files import output_folder
from ..io.meshes import write_ply
from ..io.pc2 import write_pc2
from ..io.report import FrameReport
from ..io.sequence import held_frames
from .cache import KEY_LENGTH, Arrays, digest
from .context import Context
from .deforming import GroupShape, deform_reference
from .refer import Group
from .tracked import Tracked

DEFORMATION_SCHEMA = 2
FLIPPED_WARNING = 0.001  # share of flipped triangles above which a frame is named in the warnings


@dataclass(frozen=True)
class Deformed:
    """frames : index of frame -> the deformed reference of its group.  handovers : index of group -> its reference in the next one's
    first frame.
    """

    frames: dict[int, TriangleMesh]
    handovers: dict[int, TriangleMesh]


def deform(context: Context, tracked: Tracked, groups: list[Group]) -> Deformed:
    """The reference meshes in all frames; writes a PLY for each frame and a point cache for each group."""
    settings = context.settings.deformation
    keys = {group.index: digest(DEFORMATION_SCHEMA, group.key, asdict(settings)) for group in groups}
    jobs = [(group, frame) for group in groups for frame in group.targets]
    found = {(group.index, frame): context.cache.load(_entry(context, group, frame), keys[group.index]) for group, frame in jobs}
    waiting = [(group, frame) for group, frame in jobs if found[group.index, frame] is None]
    shapes = {group.index: GroupShape(keys[group.index], group.mesh, group.centers, settings) for group in groups}
    tasks = (_task(context, tracked, shapes[group.index], group, frame) for group, frame in waiting)
    for count, (index, result) in enumerate(context.workers.map(deform_reference, tasks, lambda: context.notify("deformation", None, 0.0))):
        group, frame = waiting[index]
        found[group.index, frame] = result
        context.cache.save(_entry(context, group, frame), keys[group.index], result)
        context.notify("deformation", context.numbers[frame], (len(jobs) - len(waiting) + count + 1) / len(jobs))
    carried = {(group.index, frame): group.mesh.moved(found[group.index, frame]["vertices"]) for group, frame in jobs}
    deformed = {frame: carried[group.index, frame] for group in groups for frame in group.frames}
    for group in groups:
        _write_frames(context, group, found)
        _write_playback(context, group, deformed, keys[group.index])
    context.remove_stale("deformed/frame_*.ply", keep=[frame.deformed for frame in context.report.frames])
    context.remove_stale("playback/group_*.pc2", keep=[group.playback for group in context.report.groups])
    return Deformed(deformed, {group.index: carried[group.index, group.handover] for group in groups if group.handover is not None})


def _task(context: Context, tracked: Tracked, shape: GroupShape, group: Group, frame: int) -> tuple:
    return shape, group.targets[frame], context.frames.mesh(frame), tracked.seen((group.frames[0], frame))[1]


def _entry(context: Context, group: Group, frame: int) -> str:
    return f"deformation/handover_{group.index:03d}" if frame == group.handover else f"deformation/frame_{context.numbers[frame]:04d}"


def _write_frames(context: Context, group: Group, found: dict[tuple[int, int], Arrays]) -> None:
    output_folder(context.output / "deformed")
    for frame in group.frames:
        number = context.numbers[frame]
        flipped, held, hidden = (float(found[group.index, frame][name].mean()) for name in ("folded", "held", "hidden"))
        entry = FrameReport(number, group.index, f"deformed/frame_{number:04d}.ply", flipped, held, hidden)
        write_ply(context.output / entry.deformed, group.mesh.moved(found[group.index, frame]["vertices"]))
        context.report.frames.append(entry)
        if flipped > FLIPPED_WARNING:
            context.warn(f"frame {number}: {flipped:.2%} of the triangles are flipped; a smaller --group-size may serve it better")


def _write_playback(context: Context, group: Group, deformed: dict[int, TriangleMesh], key: str) -> None:
    playback = f"playback/group_{group.index:03d}-{key[:KEY_LENGTH]}.pc2"
    shown = [frame for frame in held_frames(context.frames.sequence) if frame in group.frames]
    samples = (np.asarray(deformed[frame].vertices) for frame in shown)
    write_pc2(context.output / playback, samples, len(group.mesh.vertices), len(shown))
    context.report.groups[group.index] = replace(context.report.groups[group.index], playback=playback)
