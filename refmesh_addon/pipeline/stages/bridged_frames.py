"""Frames that are missing or bad, in the results: the mesh moves on from the frame before to the one after, or the one before is held."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...core.capture.bad_frames import LONGEST
from ...core.geometry.hermite import hermite
from ...io.ply import write_ply
from ...io.report import FrameReport, deformed_path
from ...io.sequence import timeline_frame
from ..session.context import Context
from .deformation import DeformedSequence, SmoothedFrame
from .groups import FrameGroup


def played(context: Context, deformed: DeformedSequence, group: FrameGroup) -> Iterator[np.ndarray]:
    """(R, 3) vertices of a group's mesh in each scene frame that shows it."""
    sequence = context.report.sequence
    starts = [timeline_frame(sequence, number) for number in context.numbers]
    inner = [bad for bad in context.left_out.frames if bad.before != bad.after]  # playback holds its first and its last frame
    shares = {timeline_frame(sequence, bad.frame): _share(bad.frame, bad.before, bad.after) for bad in inner}
    for scene_frame, index in enumerate(context.shown, starts[0]):
        if index in group.frames:
            row, start = group.frames.index(index), starts[index]
            if scene_frame == start:
                yield deformed.row(group, row).vertices
            else:
                share = shares.get(scene_frame) or _share(scene_frame, start, starts[index + 1])
                yield bridged(context, deformed, group, row, share).vertices


def bridged(context: Context, deformed: DeformedSequence, group: FrameGroup, row: int, share: float) -> SmoothedFrame:
    """A group's mesh between one of its frames and the next one of the take, at a share of the way."""
    if not _moves(context, group, row):
        return _held(deformed, group, row)
    start, end = (deformed.row(group, one) for one in (row, row + 1))
    if start.absent or end.absent:  # a body that one of them does not show is in a point there, and would shrink or grow on the way
        return _held(deformed, group, row)
    first, last = (context.numbers[frame] for frame in group.frames[row : row + 2])
    moves = (start.velocities * (last - first), end.velocities * (last - first))
    vertices, velocities = hermite((start.vertices, end.vertices), moves, share)
    per_frame = (velocities / (last - first)).astype(start.velocities.dtype)
    return SmoothedFrame(deformed.without_pieces(group, vertices), per_frame, 0.0, 1.0, 0.0, 0.0)


def _held(deformed: DeformedSequence, group: FrameGroup, row: int) -> SmoothedFrame:
    """A group's mesh at rest as in one of its frames."""
    start = deformed.row(group, row)
    return SmoothedFrame(deformed.without_pieces(group, start.vertices), np.zeros_like(start.velocities), 0.0, 1.0, 0.0, start.absent)


def write_bridged(context: Context, deformed: DeformedSequence, group: FrameGroup) -> None:
    """The bad frames beside frames of a group, as PLY and in the report."""
    rows = {context.numbers[frame]: row for row, frame in enumerate(group.frames)}
    for bad in (bad for bad in context.left_out.frames if bad.before in rows):
        row = rows[bad.before]
        moves = bad.bridged and _moves(context, group, row)
        if moves:
            frame = bridged(context, deformed, group, row, _share(bad.frame, bad.before, bad.after))
        else:
            frame = _held(deformed, group, row)
        ends = (bad.before, bad.after) if moves else (bad.before,)
        entry = FrameReport(bad.frame, group.index, deformed_path(bad.frame), held=1.0, absent=frame.absent, between=ends)
        write_ply(context.claim(entry.deformed), deformed.references[group.index].mesh.moved(frame.vertices), None, frame.velocities)
        context.report.frames.append(entry)


def _moves(context: Context, group: FrameGroup, row: int) -> bool:
    """Whether a group's mesh moves on from one of its frames to the next: it has both, and only a moment is missing between them."""
    if not context.left_out.bridged or row + 1 >= len(group.frames):
        return False
    here, following = (timeline_frame(context.report.sequence, context.numbers[frame]) for frame in group.frames[row : row + 2])
    return following - here <= LONGEST + 1


def _share(here: float, start: float, end: float) -> float:
    return (here - start) / (end - start)
