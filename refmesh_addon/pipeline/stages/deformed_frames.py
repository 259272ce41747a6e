"""The deformed frames in the output folder: a PLY each, a point cache for each group, entries in the report, warnings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...core.evaluation.error_scale import error_colors
from ...core.evaluation.far_places import FAR, FarPlaces
from ...core.evaluation.metrics import MeasuredFrame
from ...core.geometry.stretch import RestShape
from ...io.files import output_folder
from ...io.frame_range import format_frames, format_others
from ...io.pc2 import write_pc2
from ...io.ply import write_ply
from ...io.report import DEFORMED_FOLDER, DriftReport, FarPlace, FrameReport, deformed_path
from ..session.cache import KEY_LENGTH
from ..session.context import Context
from .bridged_frames import played, write_bridged
from .deformation import DeformedSequence, SmoothedFrame
from .groups import FrameGroup
from .removed_surface import remove_stale_removed, write_removed
from .visibility import steady_visibility, visible_vertices

# Kinds of places at which a frame and its source are far apart, as fields of `MeasuredFrame`.
KINDS = {"extra": ("deformed surface", "the source"), "missing": ("source", "the deformed surface")}
FLIPPED_WARNING = 0.001  # share of flipped triangles above which a frame is named in the warnings


def write_playbacks(context: Context, deformed: DeformedSequence) -> None:
    """The point cache of each group, from which Blender plays it."""
    output_folder(context.output / "playback")
    for group in deformed.groups:
        _write_playback(context, deformed, group)
    context.remove_stale("playback/group_*.pc2", keep=[group.playback for group in context.report.groups if group.playback])


def publish_group(context: Context, deformed: DeformedSequence, group: FrameGroup) -> None:
    """Writes the point cache of one group and the report, so that the group can be shown while others are still being deformed."""
    output_folder(context.output / "playback")
    _write_playback(context, deformed, group)
    context.write_report()
    context.group_ready(group.index)


def write_deformed(context: Context, deformed: DeformedSequence, measured: Mapping[int, MeasuredFrame] | None = None) -> None:
    """Each frame as PLY and in the report, with its distances and colored by its errors where it was measured.

    measured : by index of the frame.
    """
    output_folder(context.output / DEFORMED_FOLDER)
    visible = visible_vertices(context, deformed)
    for group in deformed.groups:
        rest = RestShape(deformed.references[group.index].mesh)
        for row, frame in enumerate(group.frames):
            smoothed = deformed.row(group, row)
            entry = replace(_frame_report(context, smoothed, group, row), overstretched=rest.overstretched(smoothed.vertices))
            entry = replace(entry, **write_removed(context, frame))  # by the names of the report
            entry = replace(entry, drift=_drift_report(deformed, group, frame))
            colors = None
            if measured is not None:
                entry = replace(entry, **vars(measured[frame].distances))  # its figures have the same names in the report
                colors = error_colors(measured[frame].errors)
                for kind in KINDS:
                    context.report.far_places += _reported(entry.number, kind, getattr(measured[frame], kind))
            visibility = steady_visibility(visible, group, row) if visible else None
            write_ply(context.claim(entry.deformed), deformed.mesh(group, frame), colors, smoothed.velocities, visibility=visibility)
            context.report.frames.append(entry)
        write_bridged(context, deformed, group)
    context.report.frames.sort(key=lambda entry: entry.number)
    context.remove_stale("deformed/frame_*.ply", keep=[frame.deformed for frame in context.report.frames])
    remove_stale_removed(context)
    context.report.far_places.sort(key=lambda place: -place.distance)
    _warn_of_far_places(context)
    _warn_of_absent(context)
    _warn_of_flipped(context)


def _reported(number: int, kind: str, places: FarPlaces) -> list[FarPlace]:
    rows = zip(places.distances.tolist(), places.positions.tolist(), places.areas.tolist(), strict=True)
    return [FarPlace(number, kind, distance, tuple(position), area) for distance, position, area in rows]


def _warn_of_far_places(context: Context) -> None:
    """One warning of each kind, at its worst place."""
    for kind, (surface, other) in KINDS.items():
        places = [place for place in context.report.far_places if place.kind == kind]
        if places:
            worst, numbers = places[0], sorted({place.frame for place in places})
            where = "({:.4g}, {:.4g}, {:.4g})".format(*worst.position)
            others = format_others(numbers, context.numbers, f"beyond {FAR:.0%}")
            context.warn(f"frame {worst.frame}: {surface} lies {worst.distance:.1%} of the diagonal from {other}, at {where}{others}")


def _warn_of_absent(context: Context) -> None:
    numbers = [frame.number for frame in context.report.frames if frame.absent]
    if numbers:
        what = "bodies of the mesh that the capture does not show there are shrunk to a point of the surface"
        context.warn(f"{format_frames(numbers, context.numbers)}: {what}")


def _warn_of_flipped(context: Context) -> None:
    """One warning for all frames, at the worst. In an open take, triangles out of view count as well, and no other mesh helps."""
    frames = [frame for frame in context.report.frames if frame.flipped > FLIPPED_WARNING]
    if not frames:
        return
    worst = max(frames, key=lambda frame: frame.flipped)
    others = format_others((frame.number for frame in frames), context.numbers, f"more than {FLIPPED_WARNING:.1%}")
    by_groups = context.settings.reference.segments == "groups"
    better = "a smaller --group-size may serve better" if by_groups else "begin another mesh there (--group-starts)"
    remedy = f"; {better}" if context.frames.take is None else ", with those out of view"
    context.warn(f"frame {worst.number}: {worst.flipped:.2%} of the triangles are flipped{others}{remedy}")


def _frame_report(context: Context, smoothed: SmoothedFrame, group: FrameGroup, row: int) -> FrameReport:
    number = context.numbers[group.frames[row]]
    capped = context.frames.statistics[group.frames[row]].capped
    shares = {name: getattr(smoothed, name) for name in ("flipped", "held", "hidden", "absent")}
    return FrameReport(number, group.index, deformed_path(number), **shares, capped=capped)


def _drift_report(deformed: DeformedSequence, group: FrameGroup, frame: int) -> DriftReport | None:
    undrifted = deformed.undrifted.get((group.index, frame))
    if undrifted is None:
        return None
    distances = 100 * undrifted.distance_before, 100 * undrifted.distance_after
    return DriftReport(undrifted.agreeing, undrifted.slide, *distances)


def _write_playback(context: Context, deformed: DeformedSequence, group: FrameGroup) -> None:
    playback = f"playback/group_{group.index:03d}-{group.key[:KEY_LENGTH]}.pc2"
    count = len(deformed.references[group.index].mesh.vertices)
    shown = sum(frame in group.frames for frame in context.shown)
    write_pc2(context.claim(playback), played(context, deformed, group), count, shown, context.frames.offset)
    context.report.groups[group.index] = replace(context.report.groups[group.index], playback=playback)
