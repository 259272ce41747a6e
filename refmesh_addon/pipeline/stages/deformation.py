"""The deformation stage: each group's reference mesh in each of its frames."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from ...core.arrays import from_arrays, to_arrays
from ...core.deformation.deformer import DeformedFrame, GroupReference, deform_reference
from ...core.deformation.facing import Facing
from ...core.deformation.fold_free_moves import moved_without_folds
from ...core.deformation.temporal_smoothing import smoothed_in_time
from ...core.errors import RefMeshError
from ...core.types import TriangleMesh
from ...io.files import output_folder
from ...io.pc2 import write_pc2
from ...io.ply import write_ply
from ...io.report import DEFORMED_FOLDER, FrameReport, deformed_path
from ...io.sequence import held_frames
from ..session.cache import KEY_LENGTH, digest
from ..session.context import Context
from .reference import Group
from .tracking_result import Tracked

DEFORMATION_SCHEMA = 9
FLIPPED_WARNING = 0.001  # share of flipped triangles above which a frame is named in the warnings


@dataclass(frozen=True)
class Deformed:
    """frames : index of frame -> the deformed reference of its group.  velocities : index of frame -> (R, 3) scene units per frame.
    handovers : index of group -> its reference in the next one's first frame.
    """

    frames: dict[int, TriangleMesh]
    velocities: dict[int, np.ndarray]
    handovers: dict[int, TriangleMesh]


def deform(context: Context, tracked: Tracked, groups: list[Group]) -> Deformed:
    """The reference meshes in all frames; writes a PLY for each frame and a point cache for each group."""
    settings = replace(context.settings.deformation, steady_frames=0)  # evening out comes later, and each time
    keys = {group.index: digest(DEFORMATION_SCHEMA, group.key, asdict(settings)) for group in groups}
    jobs = [(group, frame) for group in groups for frame in group.targets]
    waiting = [(group, frame) for group, frame in jobs if context.cache.load(_entry(context, group, frame), keys[group.index]) is None]
    mapping = context.settings.reference.mapping
    shapes = {group.index: GroupReference(keys[group.index], group.mesh, group.centers, settings, mapping) for group in groups}
    tasks = (_task(context, tracked, shapes[group.index], group, frame) for group, frame in waiting)
    for count, (index, result) in enumerate(context.workers.map(deform_reference, tasks, lambda: context.notify("deformation", None, 0.0))):
        group, frame = waiting[index]
        context.cache.save(_entry(context, group, frame), keys[group.index], to_arrays(result))
        context.notify("deformation", context.numbers[frame], (len(jobs) - len(waiting) + count + 1) / len(jobs))
    deformed, velocities, handovers = {}, {}, {}
    for group in groups:
        meshes, moving = _finished(context, group, keys[group.index])
        if group.handover is not None:
            handovers[group.index] = meshes.pop(group.handover)
        deformed |= meshes
        velocities |= {frame: moving[frame] for frame in meshes}
        _write_playback(context, group, deformed, keys[group.index])
    context.remove_stale("deformed/frame_*.ply", keep=[frame.deformed for frame in context.report.frames])
    context.remove_stale("playback/group_*.pc2", keep=[group.playback for group in context.report.groups])
    return Deformed(deformed, velocities, handovers)


def _task(context: Context, tracked: Tracked, shape: GroupReference, group: Group, frame: int) -> tuple:
    return shape, group.targets[frame], context.frames.surface(frame), tracked.seen((group.frames[0], frame))[1]


def _entry(context: Context, group: Group, frame: int) -> str:
    return f"deformation/handover_{group.index:03d}" if frame == group.handover else f"deformation/frame_{context.numbers[frame]:04d}"


def _finished(context: Context, group: Group, key: str) -> tuple[dict[int, TriangleMesh], dict[int, np.ndarray]]:
    """The group's frames and its hand-over, smoothed over time, and their velocities; the frames are written and reported."""
    entries = {frame: _read_again(context, group, frame, key) for frame in group.targets}
    vertices, times = np.stack([entry.vertices for entry in entries.values()]), np.array([context.numbers[frame] for frame in entries])
    facings = [Facing(group.mesh, entry.rotations) for entry in entries.values()]
    steady = smoothed_in_time(group.mesh, vertices, times, context.settings.deformation.steady_frames)
    placed = np.stack([moved_without_folds(*moves) for moves in zip(facings, vertices, steady, strict=True)])
    meshes = {frame: group.mesh.moved(positions) for frame, positions in zip(entries, placed, strict=True)}
    speeds = np.gradient(placed, times, axis=0) if len(times) > 1 else np.zeros_like(placed)
    velocities = dict(zip(entries, speeds, strict=True))
    output_folder(context.output / DEFORMED_FOLDER)
    for frame, facing in zip(group.frames, facings, strict=False):
        entry = entries[frame]
        flipped = facing.folded(meshes[frame].vertices) & ~entry.curled
        report = _reported(context, group, frame, (flipped, entry.held, entry.hidden))
        write_ply(context.output / report.deformed, meshes[frame], velocities=velocities[frame])
    return meshes, velocities


def _read_again(context: Context, group: Group, frame: int, key: str) -> DeformedFrame:
    """What was made of a frame; from the disk, so that a long take does not fill the memory."""
    entry = _entry(context, group, frame)
    found = context.cache.load(entry, key)
    if found is None:
        raise RefMeshError(f"{context.cache.path(entry, key)}: cannot be read again; run the job once more")
    return from_arrays(DeformedFrame, found)


def _reported(context: Context, group: Group, frame: int, flags: tuple[np.ndarray, np.ndarray, np.ndarray]) -> FrameReport:
    number = context.numbers[frame]
    flipped, held, hidden = (float(flag.mean()) for flag in flags)
    entry = FrameReport(number, group.index, deformed_path(number), flipped, held, hidden)
    context.report.frames.append(entry)
    if flipped > FLIPPED_WARNING:
        context.warn(f"frame {number}: {flipped:.2%} of the triangles are flipped; a smaller --group-size may serve it better")
    return entry


def _write_playback(context: Context, group: Group, deformed: dict[int, TriangleMesh], key: str) -> None:
    key = digest(key, context.settings.deformation.steady_frames)
    playback = f"playback/group_{group.index:03d}-{key[:KEY_LENGTH]}.pc2"
    shown = [frame for frame in held_frames(context.frames.sequence) if frame in group.frames]
    samples = (np.asarray(deformed[frame].vertices) for frame in shown)
    write_pc2(context.output / playback, samples, len(group.mesh.vertices), len(shown))
    context.report.groups[group.index] = replace(context.report.groups[group.index], playback=playback)
