"""Tracking group by group: each group starts anew, so groups need nothing of each other and share the cores.

A group is tracked one frame further, into the first of the next. Both have centers there, and those of the next
group take the numbers of the nearest ones: a center keeps its number and jumps to the place of its partner.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from scipy import sparse

from ...core.errors import RefMeshError
from ...core.settings import TrackingSettings
from ...core.tracking.forward import first_frame
from ...core.tracking.opening_gaps import tracked_on
from ...core.tracking.renumbering import assignment
from ...core.types import TriangleMesh
from ..session.cache import digest
from ..session.cached_map import WorkUnit, cached_map
from ..session.context import READING_SHARE, Context
from ..session.job import TRACKING
from ..session.stage_share import StageShare
from .groups import fixed_groups
from .tracking import TRACKING_SCHEMA, enclosed_volume, view_schema
from .tracking_report import report_tracking
from .tracking_result import TrackedFrames, TrackedRange, TrackingResult


@dataclass(frozen=True)
class TrackedGroup:
    """frames : of the group, and the first of the next where there is one.  affinity : (C, C) weights.  spacing : s, scene units."""

    frames: TrackedFrames
    affinity: sparse.csr_matrix
    spacing: float


def track_groups(context: Context) -> TrackingResult:
    """Tracks each group of frames by itself. Raises RefMeshError when global rounds, or groups by content, are requested too."""
    if context.settings.tracking.global_rounds:
        raise RefMeshError("--global-rounds optimizes the whole sequence at once: leave it out, or track with --tracking sequence")
    groups = fixed_groups(context)
    units = {index: _unit(context, index, frames) for index, frames in enumerate(groups)}
    tracked = cached_map(context, track_group, units, TrackedGroup, StageShare(TRACKING, READING_SHARE))
    return _joined(context, groups, tracked, [unit.key for unit in units.values()])


def track_group(bodies: list[TriangleMesh], paths: list[Path], settings: TrackingSettings, is_view: bool = False) -> TrackedGroup:
    """Centers carried from the first of some frames to the last. Raises RefMeshError, naming the file, where that is impossible.

    is_view : whether the frames are what a camera sees of bodies.
    """
    state, before, frames = None, None, []
    for body, path in zip(bodies, paths, strict=True):
        volume = replace(enclosed_volume(body, path, settings), is_view=is_view)
        state = tracked_on(state, volume, settings, lambda earlier=before: earlier) if state else first_frame(volume, settings)
        before = volume
        frames.append(TrackedFrames.of(state, volume, path))
    assert state is not None, "a group has at least one frame"
    return TrackedGroup(TrackedFrames.concatenated(frames), state.affinity.weights(), state.affinity.spacing)


def _unit(context: Context, index: int, group: tuple[int, ...]) -> WorkUnit:
    """A group and the first frame of the next."""
    frames, settings = context.frames, context.settings.tracking
    reach = range(group[0], min(group[-1] + 2, len(frames)))
    followed = {name: value for name, value in asdict(settings).items() if name not in ("surface", "bad_frames")}  # which the frames tell
    key = digest(TRACKING_SCHEMA, followed, [frames.keys[frame] for frame in reach], *view_schema(context))

    def arguments() -> tuple:
        paths = [frames.path(frame) for frame in reach]
        return [frames.body(frame) for frame in reach], paths, settings, frames.take is not None

    return WorkUnit(f"tracking/group_{index:03d}", key, arguments, context.numbers[group[-1]])


def _joined(context: Context, groups: list[tuple[int, ...]], tracked: Mapping[int, TrackedGroup], keys: list[str]) -> TrackingResult:
    """The groups one after the other, with center numbers that continue; the distances between partners are reported."""
    parts, steps, key = [], [], ""
    ranges: list[TrackedRange] = []
    for index, frames in enumerate(groups):
        group, beyond = tracked[index], ranges[-1].beyond if ranges else None
        centers = group.frames.centers
        order = np.arange(centers.shape[1]) if beyond is None else assignment(beyond, centers[0])
        if beyond is not None:
            apart = np.linalg.norm(centers[0][order] - beyond, axis=1)
            steps.append(float(np.sqrt(np.mean(apart**2)) / group.spacing))
        key = digest(key, keys[index])  # the numbers, and nothing else, depend on the groups before
        parts.append(group.frames.renumbered(len(frames), order))
        beyond = centers[len(frames), order] if len(centers) > len(frames) else None
        ranges.append(TrackedRange(frames[-1] + 1, group.spacing, key, _affinity_in_order(tracked, index, order), beyond))
    joined = TrackedFrames.concatenated(parts)
    report_tracking(context, joined, ranges[0].spacing)
    context.report.tracking["handover"] = steps
    return TrackingResult(joined.centers, tuple(ranges))


def _affinity_in_order(tracked: Mapping[int, TrackedGroup], index: int, order: np.ndarray) -> Callable[[], sparse.csr_matrix]:
    return lambda: tracked[index].affinity[order][:, order].tocsr()
