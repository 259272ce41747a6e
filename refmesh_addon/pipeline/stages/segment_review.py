"""How long one mesh serves the frames of a run, with little more deformed than the result needs.

First some frames of each run are probed: the mesh of the run is deformed to those in which centers are strained most, and where it
does not do, to the worst frame of its group the mesh of that group alone. Only where that serves the frame better by stated limits
is the run cut. Where it goes on from there is found out by sketches, meshes of some frames of each part. Then all frames are deformed
and measured, and groups that the probes missed get a mesh of their own, while the rest of their run keeps its mesh.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...core.evaluation.segment_limits import FrameFigures, excess, passed_limits, usual_figures, worse_of
from ...core.evaluation.stretch import RestShape
from ...core.reference.grouping import frame_stress, least_strained_cut
from ..session.context import Context
from .deformation import DeformedSequence
from .evaluation import measure_frames
from .groups import chosen_groups
from .probes import probe
from .reference import GroupedFrames, References, group_frames, make_references
from .segments import FINAL, OWN_FOLDER, PROBED, Cuts, SegmentPlan, kept_plan
from .tracking_result import TrackingResult

EXTRA = 0.5  # of the frames of a take: at most so many are deformed by the review beyond the result's
LEAST_EXTRA = 8  # frames, in takes so short that nothing could be tried otherwise
ROUNDS = 4  # of cuts by probes
PROBED_SHARE = 8  # a run has one probe for so many frames
LEAST_PROBES = 2
SKETCHED = 20  # frames that a sketch is made from beside its probes, at most
SHORTEST_VIEW = 2  # frames of an open take that have a mesh: one alone would be its own mesh
SKETCH_FOLDER = "sketch/"  # in the cache
OWN_MESH, AFTER_OWN = "one mesh does not serve both sides: ", "the group before has a mesh of its own: "

Run = tuple[int, ...]  # indices of consecutive frames


@dataclass
class Allowance:
    """Frames that may still be deformed beyond those of the result.  spent : those that were."""

    frames: int
    spent: int = 0

    @classmethod
    def of(cls, context: Context, plan: SegmentPlan) -> Allowance:
        """For a take, after what its plan has spent."""
        return cls(max(int(EXTRA * len(context.frames)), LEAST_EXTRA), plan.spent)

    def take(self, frames: int) -> bool:
        """Whether so many more are allowed; they are spent then."""
        allowed = self.spent + frames <= self.frames
        self.spent += frames * allowed
        return allowed


def cut_by_probes(context: Context, tracking: TrackingResult, plan: SegmentPlan, references: References) -> SegmentPlan:
    """The plan with cuts where probes show that the mesh of a run does not serve all of it.  references : the meshes of its runs."""
    quiet, allowance, starts = context.without_progress(), Allowance.of(context, plan), plan.starts
    bodies, divisible = plan.grouped.bodies, lambda run: len(_groups_within(context, tracking, run)) > 1
    runs = {group.index: group.frames for group in plan.grouped.groups if divisible(group.frames)}
    for _ in range(ROUNDS):
        probes = {index: probed_frames(context, tracking, run) for index, run in runs.items()}
        if not runs or not allowance.take(sum(map(len, probes.values()))):
            break
        figures, parts = probe(quiet, tracking, references, probes), []
        for index, run in runs.items():
            cut = _cut(quiet, tracking, bodies, run, {frame: figures[frame] for frame in probes[index]}, allowance)
            parts += [part for start in cut for part in (run[: start - run[0]], run[start - run[0] :]) if divisible(part)]
            starts |= cut
        runs = dict(enumerate(parts))
        references = _sketches(quiet, tracking, bodies, runs) if runs else references
    return kept_plan(context, tracking, bodies, Cuts.at(starts, len(context.frames), PROBED, allowance.spent))


def with_own_meshes(
    context: Context, tracking: TrackingResult, plan: SegmentPlan, references: References, deformed: DeformedSequence
) -> SegmentPlan:
    """The final plan: groups that the mesh of their run does not serve have one of their own, the worst first.

    deformed : the meshes of the plan's runs in all frames.
    """
    quiet, allowance, own = context.without_progress(), Allowance.of(context, plan), {}
    figures = _figures(context, deformed)
    usual = {group.index: usual_figures([figures[frame] for frame in group.frames]) for group in plan.grouped.groups}
    for index, group, frame in _doubtful(context, tracking, plan, figures, usual):
        if passed_limits(figures[frame], usual[index]) and allowance.take(len(group)):
            theirs = _own_figures(quiet, tracking, plan.grouped.bodies, group, frame)
            usual[index] = worse_of(usual[index], theirs)
            limits = passed_limits(probe(quiet, tracking, references, {index: (frame,)})[frame], theirs)
            own |= {group: _reason(context, frame, limits)} if limits else {}
    return kept_plan(context, tracking, plan.grouped.bodies, cuts_around(plan, own, allowance.spent))


def cuts_around(plan: SegmentPlan, own: Mapping[Run, str], spent: int) -> Cuts:
    """The plan's runs, cut before and after groups with a mesh of their own.  own : these groups -> why."""
    rows = {}
    for run in plan.grouped.groups:
        whole = (run.source[0], run.source[-1] + 1)
        rows[run.frames[0]] = (plan.starts[run.frames[0]], whole, False)
        for group, reason in sorted(own.items()):
            if group[-1] < run.frames[-1] and group[0] in run.frames:
                rows.setdefault(group[-1] + 1, (AFTER_OWN + reason.removeprefix(OWN_MESH), whole, False))
            if group[0] in run.frames:
                rows[group[0]] = (reason, (group[0], group[-1] + 1), True)
    starts = sorted(rows)
    reasons, sources, alone = zip(*(rows[start] for start in starts), strict=True)
    return Cuts(np.array(starts), reasons, np.array(sources), np.array(alone), FINAL, spent)


def probed_frames(context: Context, tracking: TrackingResult, run: Run) -> tuple[int, ...]:
    """The frame of each group within a run in which centers are strained most; those of the most strained groups."""
    stress = dict(zip(run, frame_stress(tracking.centers_in(run), tracking.affinity_at(run[0])).tolist(), strict=True))
    worst = [max(group, key=lambda frame: stress[frame]) for group in _groups_within(context, tracking, run)]
    most = max(LEAST_PROBES, -(-len(run) // PROBED_SHARE))
    return tuple(sorted(sorted(worst, key=lambda frame: -stress[frame])[:most]))


def _sketches(context: Context, tracking: TrackingResult, bodies: np.ndarray | None, runs: Mapping[int, Run]) -> References:
    """Meshes of some frames of each run, evenly chosen, and its probes."""
    probes = [probed_frames(context, tracking, run) for run in runs.values()]
    even = [{run[row] for row in np.linspace(0, len(run) - 1, SKETCHED).astype(int).tolist()} for run in runs.values()]
    sources = [tuple(sorted(chosen.union(own))) for chosen, own in zip(even, probes, strict=True)]
    grouped = group_frames(context, tracking, bodies, probes, sources, segment=True, folder=SKETCH_FOLDER)
    alone = tuple(replace(group, handover=None) for group in grouped.groups)
    return make_references(context, tracking, GroupedFrames(alone, bodies))


def _cut(
    context: Context,
    tracking: TrackingResult,
    bodies: np.ndarray | None,
    run: Run,
    figures: Mapping[int, FrameFigures],
    allowance: Allowance,
) -> dict[int, str]:
    """Where a run is cut and why: at the first group whose own mesh serves its probe better; nowhere if there is none.

    figures : of the probes, by index of the frame.
    """
    usual, groups = usual_figures(list(figures.values())), _groups_within(context, tracking, run)
    for frame in figures:
        group = next(group for group in groups if frame in group)
        if not passed_limits(figures[frame], usual) or not allowance.take(len(group)):
            continue
        own = _own_figures(context, tracking, bodies, group, frame)
        usual = worse_of(usual, own)
        limits = passed_limits(figures[frame], own)
        if limits:
            return {group[0] if group != groups[0] else _best_cut(tracking, run, groups): _reason(context, frame, limits)}
    return {}


def _best_cut(tracking: TrackingResult, run: Run, groups: list[Run]) -> int:
    """Where a run is cut that serves not even its first group: its reference positions suit neither part."""
    candidates = [group[0] - run[0] for group in groups[1:]]
    return run[0] + least_strained_cut(tracking.centers_in(run), tracking.affinity_at(run[0]), candidates)


def _groups_within(context: Context, tracking: TrackingResult, run: Run) -> list[Run]:
    """The groups of the method, as far as they lie within a run. Of an open take, a run of one group may be divided further.

    What one camera sees changes faster than bodies deform: an arm that passes hides half of a chest within a frame or two.
    """
    members = set(run)
    groups = [inside for group in chosen_groups(context, tracking) if (inside := tuple(frame for frame in group if frame in members))]
    if len(groups) > 1 or len(run) < 2 * SHORTEST_VIEW or context.frames.take is None:
        return groups
    candidates = list(range(SHORTEST_VIEW, len(run) - SHORTEST_VIEW + 1))
    cut = least_strained_cut(tracking.centers_in(run), tracking.affinity_at(run[0]), candidates)
    return [run[:cut], run[cut:]]


def _own_figures(context: Context, tracking: TrackingResult, bodies: np.ndarray | None, group: Run, frame: int) -> FrameFigures:
    """Of one frame, with a mesh for its group alone."""
    grouped = group_frames(context, tracking, bodies, [group], segment=True, folder=OWN_FOLDER)
    return probe(context, tracking, make_references(context, tracking, grouped), {0: (frame,)})[frame]


def _figures(context: Context, deformed: DeformedSequence) -> dict[int, FrameFigures]:
    """Of all frames, by index."""
    measured, figures = measure_frames(context, deformed), {}
    for group in deformed.groups:
        rest = RestShape(deformed.references[group.index].mesh)
        for row, frame in enumerate(group.frames):
            distance, smoothed = measured[frame].distances.source_to_deformed, deformed.row(group, row)
            figures[frame] = FrameFigures(distance.mean, distance.p99, smoothed.flipped, rest.overstretched(smoothed.vertices))
    return figures


def _doubtful(
    context: Context, tracking: TrackingResult, plan: SegmentPlan, figures: Mapping[int, FrameFigures], usual: Mapping[int, FrameFigures]
) -> list[tuple[int, Run, int]]:
    """(index of the run, group, its worst frame) of the groups that pass the limits of their run, the worst first."""
    rows = []
    for run in plan.grouped.groups:
        groups = _groups_within(context, tracking, run.frames)
        for group in groups if len(groups) > 1 else ():
            frame = max(group, key=lambda frame: excess(figures[frame], usual[run.index]))
            rows += [(run.index, group, frame)] if passed_limits(figures[frame], usual[run.index]) else []
    return sorted(rows, key=lambda row: -excess(figures[row[2]], usual[row[0]]))


def _reason(context: Context, frame: int, limits: list[str]) -> str:
    return f"{OWN_MESH}frame {context.numbers[frame]}: {', '.join(limits)}"
