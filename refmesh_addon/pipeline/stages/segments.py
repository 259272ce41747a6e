"""Which runs of frames share one mesh: as long as it holds, as long as a group, or as long as asked.

A run is tried as a whole: one mesh, deformed to all its frames and measured. Where a frame stands out, its group is tried with a mesh
of its own, and only where that serves the frame better by stated limits another run begins. Each round cuts a run at its first
such group, or, where not even its first group is served, where its centers deform least to either side; both parts are then tried anew.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Annotated

import numpy as np

from ...core.evaluation.segment_limits import FrameFigures, passed_limits, usual_figures, worse_of
from ...core.evaluation.stretch import RestShape
from ...core.reference.grouping import content_groups, least_strained_cut
from ...core.types import FrozenArrays
from ..session.cache import digest
from ..session.context import Context
from .deformation import DeformedSequence, deform
from .evaluation import measure_frames
from .groups import FrameGroup, chosen_groups, divided, fixed_groups
from .marked_bodies import bodies_apart
from .reference import GroupedFrames, group_frames, make_references
from .tracking_result import TrackingResult

PLAN_SCHEMA = 1
ROUNDS = 4  # of cuts; after the last one every group that passes the limits has a mesh of its own
TRIAL_FOLDER = "trial/"  # in the cache, for meshes of single groups
LONGEST_VIEW = 30  # frames of an open take that one mesh is tried on: a second, in which a camera sees much the same
VIEW = "what the camera sees has changed"
FIRST, ASKED, JUMP = "the take begins", "as requested", "something appears or leaves"
OWN_MESH, AFTER_OWN = "one mesh does not serve both sides: ", "the group before has a mesh of its own: "


@dataclass(frozen=True)
class SegmentPlan:
    """Runs of frames that share a mesh.

    grouped : the runs.  reasons : why each begins.  rounds : of cuts so far.  final : whether all runs keep the limits, or none apply.
    """

    grouped: GroupedFrames
    reasons: tuple[str, ...]
    rounds: int = 0
    final: bool = True

    @property
    def starts(self) -> dict[int, str]:
        """Index of the frame at which each run begins -> why."""
        return {group.frames[0]: reason for group, reason in zip(self.grouped.groups, self.reasons, strict=True)}


@dataclass(frozen=True)
class Cuts(FrozenArrays):
    """What is kept of a plan: starts : (N,) indices of frames.  reasons : of each.  rounds, final : as in `SegmentPlan`."""

    starts: Annotated[np.ndarray, "(N) integer"]
    reasons: tuple[str, ...]
    rounds: int
    final: bool


def first_plan(context: Context, tracking: TrackingResult) -> SegmentPlan:
    """What the settings ask for; where runs are as long as they can be, what an earlier run has found out about them, if anything.

    Raises RefMeshError for marked bodies that contradict each other, and for groups that the settings do not allow.
    """
    bodies, reference = bodies_apart(context, tracking), context.settings.reference
    if _mode(context, tracking) == "groups":
        runs = chosen_groups(context, tracking)
        return SegmentPlan(group_frames(context, tracking, bodies, runs), _reasons(runs, tracking))
    if reference.group_starts.strip():
        runs = fixed_groups(context)
    elif reference.mesh:  # made to serve the whole take
        runs = [tuple(range(len(context.frames)))]
    elif reference.segments == "frames":
        every = reference.segment_frames
        runs = [tuple(range(start, min(start + every, len(context.frames)))) for start in range(0, len(context.frames), every)]
    else:
        return _remembered(context, tracking, bodies)
    runs = divided(runs, tracking.changes)
    return SegmentPlan(group_frames(context, tracking, bodies, runs, segment=True), _reasons(runs, tracking))


def reviewed(context: Context, tracking: TrackingResult, plan: SegmentPlan, deformed: DeformedSequence) -> SegmentPlan:
    """The plan with further cuts where the meshes of its runs do not serve; final where they do.

    deformed : the meshes of the plan's runs in all frames.
    """
    figures = _figures(context, deformed)
    starts, last = plan.starts, plan.rounds + 1 >= ROUNDS
    for group in plan.grouped.groups:
        starts = _cuts(context, tracking, plan.grouped.bodies, group, figures, last) | starts
    cut = len(starts) > len(plan.starts)
    return _kept(context, tracking, plan.grouped.bodies, Cuts(*_sorted(starts), plan.rounds + 1, not cut or last))


def _mode(context: Context, tracking: TrackingResult) -> str:
    mode = context.settings.reference.segments
    if context.settings.reference.mesh:
        return "long"
    if mode == "groups" or len(tracking.ranges) == 1:
        return mode
    context.warn("--tracking group follows centers through single groups only: each has a mesh of its own, whatever --segments asks for")
    return "groups"


def _reasons(runs: list[tuple[int, ...]], tracking: TrackingResult) -> tuple[str, ...]:
    return (FIRST, *(JUMP if run[0] in tracking.changes else ASKED for run in runs[1:]))


def _remembered(context: Context, tracking: TrackingResult, bodies: np.ndarray | None) -> SegmentPlan:
    starts = {0: FIRST} | {jump: JUMP for jump in (*tracking.jumps, *tracking.changes) if jump} | _changes_of_view(context, tracking)
    key = _plan_key(context, tracking, bodies)
    cuts = context.cache.load_result("segments/plan", key, Cuts) or Cuts(*_sorted(starts), 0, False)
    return _plan(context, tracking, bodies, cuts)


def _changes_of_view(context: Context, tracking: TrackingResult) -> dict[int, str]:
    """Where runs of an open take begin before any is tried.

    A mesh of all that hundreds of frames show would serve none of them, and trying it would take longer than all else.
    """
    if context.frames.take is None:
        return {}
    (whole,) = tracking.ranges
    groups = content_groups(tracking.positions, whole.load_affinity(), whole.spacing, LONGEST_VIEW)
    return {group[0]: VIEW for group in groups[1:]}


def _kept(context: Context, tracking: TrackingResult, bodies: np.ndarray | None, cuts: Cuts) -> SegmentPlan:
    context.cache.save_result("segments/plan", _plan_key(context, tracking, bodies), cuts)
    return _plan(context, tracking, bodies, cuts)


def _plan(context: Context, tracking: TrackingResult, bodies: np.ndarray | None, cuts: Cuts) -> SegmentPlan:
    ends = [*cuts.starts[1:].tolist(), len(context.frames)]
    runs = [tuple(range(start, end)) for start, end in zip(cuts.starts.tolist(), ends, strict=True)]
    return SegmentPlan(group_frames(context, tracking, bodies, runs, segment=True), cuts.reasons, cuts.rounds, cuts.final)


def _plan_key(context: Context, tracking: TrackingResult, bodies: np.ndarray | None) -> str:
    settings = context.settings
    parts = [asdict(part) for part in (settings.reference, settings.deformation, settings.evaluation)]
    (whole,) = tracking.ranges
    return digest(PLAN_SCHEMA, whole.key, context.frames.keys, *parts, None if bodies is None else bodies.tolist())


def _sorted(starts: dict[int, str]) -> tuple[np.ndarray, tuple[str, ...]]:
    return np.array(sorted(starts)), tuple(starts[start] for start in sorted(starts))


def _figures(context: Context, deformed: DeformedSequence) -> dict[int, FrameFigures]:
    """Of all frames, by index."""
    measured, figures = measure_frames(context, deformed), {}
    for group in deformed.groups:
        rest = RestShape(deformed.references[group.index].mesh)
        for row, frame in enumerate(group.frames):
            distance, smoothed = measured[frame].distances.source_to_deformed, deformed.row(group, row)
            figures[frame] = FrameFigures(distance.mean, distance.p99, smoothed.flipped, rest.overstretched(smoothed.vertices))
    return figures


def _cuts(
    context: Context, tracking: TrackingResult, bodies: np.ndarray | None, run: FrameGroup, figures: dict[int, FrameFigures], last: bool
) -> dict[int, str]:
    """Further starts within a run: of its first group that needs a mesh of its own; of all such groups in the last round."""
    usual, starts, groups = usual_figures([figures[frame] for frame in run.frames]), {}, _groups_within(context, tracking, run)
    for group, following in zip(groups, [*groups[1:], None], strict=True):
        if len(groups) == 1 or not any(passed_limits(figures[frame], usual) for frame in group):
            continue
        own = _figures(context, _tried(context, tracking, bodies, group))
        for frame in group:
            usual = worse_of(usual, own[frame])
        passed = {frame: passed_limits(figures[frame], own[frame]) for frame in group}
        reason = next((f"frame {context.numbers[frame]}: {', '.join(limits)}" for frame, limits in passed.items() if limits), "")
        if reason and not last:
            return {group[0] if group != groups[0] else _best_cut(tracking, run, groups): OWN_MESH + reason}
        if reason:
            starts |= {group[0]: OWN_MESH + reason} | ({following[0]: AFTER_OWN + reason} if following else {})
    return starts


def _best_cut(tracking: TrackingResult, run: FrameGroup, groups: list[tuple[int, ...]]) -> int:
    """Where a run is cut that serves not even its first group: its reference positions suit neither part."""
    candidates = [group[0] - run.frames[0] for group in groups[1:]]
    return run.frames[0] + least_strained_cut(tracking.centers_in(run.frames), tracking.affinity_at(run.frames[0]), candidates)


def _groups_within(context: Context, tracking: TrackingResult, run: FrameGroup) -> list[tuple[int, ...]]:
    """The groups of the method, as far as they lie within a run. Of an open take, a run of one group may be divided further.

    What one camera sees changes faster than bodies deform: an arm that passes hides half of a chest within a frame or two.
    """
    members = set(run.frames)
    groups = [inside for group in chosen_groups(context, tracking) if (inside := tuple(frame for frame in group if frame in members))]
    if len(groups) > 1 or len(run.frames) == 1 or context.frames.take is None:
        return groups
    cut = least_strained_cut(tracking.centers_in(run.frames), tracking.affinity_at(run.frames[0]), list(range(1, len(run.frames))))
    return [run.frames[:cut], run.frames[cut:]]


def _tried(context: Context, tracking: TrackingResult, bodies: np.ndarray | None, frames: tuple[int, ...]) -> DeformedSequence:
    """The frames of one group with a mesh of their own."""
    grouped = group_frames(context, tracking, bodies, [frames], segment=True, folder=TRIAL_FOLDER)
    return deform(context, tracking, make_references(context, tracking, grouped))
