"""How long one mesh serves the frames of a run, with little more deformed than the result needs.

First some frames of each run are probed: the mesh of the run is deformed to those in which centers are strained most, and where it
does not do, to the worst frame of its group the mesh of that group alone. Only where that serves the frame better by stated limits
is the run cut. Where it goes on from there is found out by sketches, meshes of some frames of each part. Then all frames are deformed
and measured, and groups that the probes missed get a mesh of their own, while the rest of their run keeps its mesh.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...core.evaluation.segment_limits import FrameFigures, excess, passed_limits, usual_figures, worse_of
from ...core.geometry.stretch import RestShape
from ..session.context import Context
from .deformation import DeformedSequence
from .evaluation import measure_frames
from .probes import counted
from .reference import References
from .segment_joining import with_short_joined, worst_figures
from .segment_trials import Run, SegmentTrials
from .segments import FINAL, PROBED, Cuts, SegmentPlan, kept_plan
from .tracking_result import TrackingResult

EXTRA = 0.5  # of the frames of a take: at most so many are deformed by the review beyond the result's
EXTRA_VIEW = 1.0  # the same of an open take, in which more than bodies changes
LEAST_EXTRA = 8  # frames, in takes so short that nothing could be tried otherwise
ROUNDS = 4  # of cuts by probes
OWN_MESH, AFTER_OWN = "one mesh does not serve both sides: ", "the group before has a mesh of its own: "


@dataclass
class Allowance:
    """Frames that may still be deformed beyond those of the result.  spent : those that were."""

    frames: int
    spent: int = 0

    @classmethod
    def of(cls, context: Context, plan: SegmentPlan) -> Allowance:
        """For a take, after what its plan has spent."""
        share = EXTRA if context.frames.take is None else EXTRA_VIEW
        return cls(max(int(share * len(context.frames)), LEAST_EXTRA), plan.spent)

    def take(self, frames: int) -> bool:
        """Whether so many more are allowed; they are spent then."""
        allowed = self.spent + frames <= self.frames
        self.spent += frames * allowed
        return allowed


def cut_by_probes(context: Context, tracking: TrackingResult, plan: SegmentPlan, references: References) -> SegmentPlan:
    """The plan with cuts where probes show that the mesh of a run does not serve all of it.  references : the meshes of its runs."""
    trials, allowance, starts = SegmentTrials(context, tracking, plan.grouped.bodies), Allowance.of(context, plan), plan.starts
    divisible = lambda run: len(trials.groups_within(run)) > 1
    runs = {group.index: group.frames for group in plan.grouped.groups if divisible(group.frames)}
    for _ in range(ROUNDS):
        probes = {index: trials.probes(run) for index, run in runs.items()}
        if not runs or not allowance.take(sum(map(len, probes.values()))):
            break
        figures, parts = trials.figures(references, probes), []
        for index, run in runs.items():
            for start, (frame, limits) in _cut(trials, run, {frame: figures[frame] for frame in probes[index]}, allowance).items():
                starts |= {start: _reason(context, frame, limits)}
                parts += [part for part in (run[: start - run[0]], run[start - run[0] :]) if divisible(part)]
        runs = dict(enumerate(parts))
        references = trials.sketches(runs) if runs else references
    return kept_plan(context, tracking, plan.grouped.bodies, Cuts.at(starts, len(context.frames), PROBED, allowance.spent))


def with_own_meshes(
    context: Context, tracking: TrackingResult, plan: SegmentPlan, references: References, deformed: DeformedSequence
) -> SegmentPlan:
    """The final plan: groups that the mesh of their run does not serve have one of their own, the worst first.

    In open takes, short runs are then joined with their neighbors where one mesh serves both.
    deformed : the meshes of the plan's runs in all frames.
    """
    trials, allowance = SegmentTrials(context, tracking, plan.grouped.bodies), Allowance.of(context, plan)
    own: dict[Run, tuple[str, tuple[int, FrameFigures]]] = {}  # why each group has a mesh of its own, and how well that serves a frame
    figures = _figures(context, deformed)
    usual = {group.index: usual_figures([figures[frame] for frame in group.frames]) for group in plan.grouped.groups}
    for index, group, frame in _doubtful(trials, plan, figures, usual):
        if passed_limits(figures[frame], usual[index]) and allowance.take(len(group)):
            theirs = trials.own_figures(group, frame)[frame]
            usual[index] = worse_of(usual[index], theirs)
            limits = passed_limits(trials.figures(references, {index: (frame,)})[frame], theirs)
            own |= {group: (_reason(context, frame, limits), (frame, theirs))} if limits else {}
    cuts = cuts_around(plan, {group: reason for group, (reason, _) in own.items()}, allowance.spent)
    if context.frames.take is not None:
        theirs = [dict([own[run][1]]) if run in own else worst_figures(figures, run) for run in cuts.runs(len(context.frames))]
        cuts = with_short_joined(cuts, theirs, trials.own_figures, context.cuts)
    return kept_plan(context, tracking, plan.grouped.bodies, cuts)


def cuts_around(plan: SegmentPlan, own: Mapping[Run, str], spent: int) -> Cuts:
    """The plan's runs, cut before and after groups with a mesh of their own.  own : these groups -> why."""
    rows = {}
    for run in plan.grouped.groups:
        whole = (run.source[0], run.source[-1] + 1)
        rows[run.frames[0]] = (plan.starts[run.frames[0]], whole)
        for group, reason in sorted(own.items()):
            if group[-1] < run.frames[-1] and group[0] in run.frames:
                rows.setdefault(group[-1] + 1, (AFTER_OWN + reason.removeprefix(OWN_MESH), whole))
            if group[0] in run.frames:
                rows[group[0]] = (reason, (group[0], group[-1] + 1))
    starts = sorted(rows)
    reasons, sources = zip(*(rows[start] for start in starts), strict=True)
    return Cuts(np.array(starts), reasons, np.array(sources), FINAL, spent)


def _cut(
    trials: SegmentTrials, run: Run, figures: Mapping[int, FrameFigures], allowance: Allowance
) -> dict[int, tuple[int, list[str]]]:
    """Where a run is cut: at the first group whose own mesh serves its probe better; nowhere if there is none.

    figures : of the probes, by index of the frame. Returns the probe and the limits that it passes, by the index of the cut.
    """
    usual, groups = usual_figures(list(figures.values())), trials.groups_within(run)
    for frame in figures:
        group = next(group for group in groups if frame in group)
        if not passed_limits(figures[frame], usual) or not allowance.take(len(group)):
            continue
        own = trials.own_figures(group, frame)[frame]
        usual = worse_of(usual, own)
        limits = passed_limits(figures[frame], own)
        if limits:
            return {group[0] if group != groups[0] else trials.best_cut(run): (frame, limits)}
    return {}


def _figures(context: Context, deformed: DeformedSequence) -> dict[int, FrameFigures]:
    """Of all frames, by index."""
    measured, figures = measure_frames(context, deformed), {}
    for group in deformed.groups:
        rest = RestShape(deformed.references[group.index].mesh)
        for row, frame in enumerate(group.frames):
            distances, smoothed = measured[frame].distances, deformed.row(group, row)
            there, overstretched = distances.source_to_deformed, rest.overstretched(smoothed.vertices)
            own = FrameFigures(there.mean, there.p99, smoothed.flipped, overstretched, distances.unseen)
            figures[frame] = counted(context, own)
    return figures


def _doubtful(
    trials: SegmentTrials, plan: SegmentPlan, figures: Mapping[int, FrameFigures], usual: Mapping[int, FrameFigures]
) -> list[tuple[int, Run, int]]:
    """(index of the run, group, its worst frame) of the groups that pass the limits of their run, the worst first."""
    rows = []
    for run in plan.grouped.groups:
        groups = trials.groups_within(run.frames)
        for group in groups if len(groups) > 1 else ():
            frame = max(group, key=lambda frame: excess(figures[frame], usual[run.index]))
            rows += [(run.index, group, frame)] if passed_limits(figures[frame], usual[run.index]) else []
    return sorted(rows, key=lambda row: -excess(figures[row[2]], usual[row[0]]))


def _reason(context: Context, frame: int, limits: list[str]) -> str:
    return f"{OWN_MESH}frame {context.numbers[frame]}: {', '.join(limits)}"
