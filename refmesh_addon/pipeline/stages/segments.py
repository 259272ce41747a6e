"""Which runs of frames share one mesh: as long as it serves them, as long as a group, or as long as the settings say.

How long a mesh serves is what `segment_review` finds out; here is what is known before that, and what is kept of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Annotated

import numpy as np

from ...core.types import FrozenArrays
from ..session.cache import digest
from ..session.context import Context
from .groups import chosen_groups, divided, fixed_groups, groups_of_views
from .marked_bodies import bodies_apart
from .reference import GroupedFrames, group_frames
from .tracking_result import TrackingResult

PLAN_SCHEMA = 3
LONGEST_VIEW = 30  # frames of an open take that one mesh is tried on: a second, in which a camera sees much the same
BAD = "the frames before are bad and are left out"
VIEW = "what the camera sees has changed"
FIRST, ASKED, JUMP = "the take begins", "as requested", "something appears or leaves"
PLANNED, PROBED, FINAL = range(3)  # how far the review of a plan is: not begun, by probes, by all frames


@dataclass(frozen=True)
class SegmentPlan:
    """Runs of frames that share a mesh.

    grouped : the runs.  reasons : why each begins.  state : PLANNED, PROBED or FINAL; None for runs that no review chooses.
    spent : frames that the review has deformed beyond those of the result.
    """

    grouped: GroupedFrames
    reasons: tuple[str, ...]
    state: int | None = None
    spent: int = 0

    @property
    def reviewed(self) -> bool:
        """Whether a review has begun."""
        return self.state in (PROBED, FINAL)

    @property
    def starts(self) -> dict[int, str]:
        """Index of the frame at which each run begins -> why."""
        return {group.frames[0]: reason for group, reason in zip(self.grouped.groups, self.reasons, strict=True)}


@dataclass(frozen=True)
class Cuts(FrozenArrays):
    """What is kept of a plan.

    starts : (N,) index of the first frame of each run.  reasons : of each.
    sources : (N, 2) from where to before where the frames are that its mesh is made from.
    state, spent : as in `SegmentPlan`.
    """

    starts: Annotated[np.ndarray, "(N) integer"]
    reasons: tuple[str, ...]
    sources: Annotated[np.ndarray, "(N, 2) integer"]
    state: int
    spent: int

    def runs(self, stop: int) -> list[tuple[int, ...]]:
        """The frames of each run.  stop : frames of the take."""
        ends = [*self.starts[1:].tolist(), stop]
        return [tuple(range(start, end)) for start, end in zip(self.starts.tolist(), ends, strict=True)]

    @classmethod
    def at(cls, starts: Mapping[int, str], stop: int, state: int = PLANNED, spent: int = 0) -> Cuts:
        """Of runs that each have a mesh of all their frames.  stop : frames of the take."""
        ordered = sorted(starts)
        sources = np.column_stack([ordered, [*ordered[1:], stop]])
        return cls(np.array(ordered), tuple(starts[start] for start in ordered), sources, state, spent)


def run_folder(context: Context, source: tuple[int, ...]) -> str:
    """In the cache, for what depends on the mesh of some frames. What was tried need not be done again where it becomes a run."""
    first, last = context.numbers[source[0]], context.numbers[source[-1]]
    sampled = "" if len(source) == source[-1] - source[0] + 1 else "_sampled"
    return "" if len(source) == len(context.frames) else f"runs/{first:04d}_{last:04d}{sampled}/"


def first_plan(context: Context, tracking: TrackingResult) -> SegmentPlan:
    """What the settings ask for; where runs are as long as they can be, what an earlier run has found out about them, if anything.

    Raises RefMeshError for marked bodies that contradict each other, and for groups that the settings do not allow.
    """
    bodies, reference = bodies_apart(context, tracking), context.settings.reference
    if _mode(context, tracking) == "groups":
        runs = chosen_groups(context, tracking)
        return SegmentPlan(group_frames(context, tracking, bodies, runs), _reasons(context, runs, tracking))
    if reference.group_starts.strip():
        runs = fixed_groups(context)
    elif reference.mesh:  # made to serve the whole take
        runs = [tuple(range(len(context.frames)))]
    elif reference.segments == "frames":
        every = reference.segment_frames
        runs = [tuple(range(start, min(start + every, len(context.frames)))) for start in range(0, len(context.frames), every)]
    else:
        return _remembered(context, tracking, bodies)
    runs = divided(runs, tuple(sorted({*tracking.changes, *context.cuts})))
    return SegmentPlan(group_frames(context, tracking, bodies, runs, segment=True), _reasons(context, runs, tracking))


def kept_plan(context: Context, tracking: TrackingResult, bodies: np.ndarray | None, cuts: Cuts) -> SegmentPlan:
    """The plan of some cuts, which the next run begins with.  bodies : (C,) that must be apart, or None."""
    context.cache.save_result("segments/plan", _plan_key(context, tracking, bodies), cuts)
    return _plan(context, tracking, bodies, cuts)


def in_folders(context: Context, grouped: GroupedFrames) -> GroupedFrames:
    """The groups with the folders of their meshes."""
    return replace(grouped, groups=tuple(replace(group, folder=run_folder(context, group.source)) for group in grouped.groups))


def _mode(context: Context, tracking: TrackingResult) -> str:
    mode = context.settings.reference.segments
    if context.settings.reference.mesh:
        return "long"
    if mode == "groups" or len(tracking.ranges) == 1:
        return mode
    context.warn("--tracking group follows centers through single groups only: each has a mesh of its own, whatever --segments asks for")
    return "groups"


def _reasons(context: Context, runs: list[tuple[int, ...]], tracking: TrackingResult) -> tuple[str, ...]:
    known = dict.fromkeys(context.cuts, BAD) | dict.fromkeys(tracking.changes, JUMP)
    return (FIRST, *(known.get(run[0], ASKED) for run in runs[1:]))


def _remembered(context: Context, tracking: TrackingResult, bodies: np.ndarray | None) -> SegmentPlan:
    cuts = {frame: BAD for frame in context.cuts} | {jump: JUMP for jump in (*tracking.jumps, *tracking.changes) if jump}
    starts = {0: FIRST} | cuts | _changes_of_view(context, tracking)
    key = _plan_key(context, tracking, bodies)
    cuts = context.cache.load_result("segments/plan", key, Cuts) or Cuts.at(starts, len(context.frames))
    return _plan(context, tracking, bodies, cuts)


def _changes_of_view(context: Context, tracking: TrackingResult) -> dict[int, str]:
    """Where runs of an open take begin before any is tried.

    A mesh of all that hundreds of frames show would serve none of them, and trying it would take longer than all else.
    """
    if context.frames.take is None:
        return {}
    return {group[0]: VIEW for group in groups_of_views(tracking, LONGEST_VIEW)[1:]}


def _plan(context: Context, tracking: TrackingResult, bodies: np.ndarray | None, cuts: Cuts) -> SegmentPlan:
    runs = cuts.runs(len(context.frames))
    grouped = group_frames(context, tracking, bodies, runs, [tuple(range(*source)) for source in cuts.sources.tolist()], segment=True)
    return SegmentPlan(in_folders(context, grouped), cuts.reasons, cuts.state, cuts.spent)


def _plan_key(context: Context, tracking: TrackingResult, bodies: np.ndarray | None) -> str:
    settings = context.settings
    parts = [asdict(part) for part in (settings.reference, settings.deformation, settings.evaluation)]
    (whole,) = tracking.ranges
    parts += [list(context.cuts)] if context.cuts else []
    return digest(PLAN_SCHEMA, whole.key, context.frames.keys, *parts, None if bodies is None else bodies.tolist())
