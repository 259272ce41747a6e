"""The stages in order."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import replace
from functools import partial

from ..io.sequence import Sequence
from .session.cluster_workers import ClusterWorkers
from .session.context import Context
from .session.job import CHECK, COLOR, DEFORMATION, EVALUATION, REFERENCE, TRACKING, JobSpec
from .session.job_input import job_sequence
from .session.parallel import Workers
from .session.part import Part, PartDone
from .session.session import WorkerPool
from .session.stage_share import Notify
from .stages.check import check_sequence
from .stages.color import color
from .stages.color_files import write_colors
from .stages.deformation import deform
from .stages.deformed_frames import publish_group, write_deformed, write_playbacks
from .stages.evaluation import evaluate
from .stages.global_rounds import optimize_globally
from .stages.marked_bodies import parsed_marks
from .stages.own_mesh import check_own
from .stages.reconstruction import check_available
from .stages.reference import References, make_references
from .stages.reference_report import write_references
from .stages.refinement import refine
from .stages.segment_review import cut_by_probes, with_own_meshes
from .stages.segments import PLANNED, PROBED, SegmentPlan, first_plan
from .stages.steps import REVIEW, TRACK
from .stages.tracking import track_sequence
from .stages.tracking_by_group import track_groups
from .stages.tracking_report import write_tracking
from .stages.tracking_result import TrackingResult
from .stages.visibility import write_visibility_sheets


def run(
    spec: JobSpec,
    notify: Notify,
    warn: Callable[[str], None],
    workers: WorkerPool | None = None,
    sequence: Sequence | None = None,
    group_ready: Callable[[int], None] = lambda index: None,
) -> None:
    """Runs the stages of a job; those whose results are in the cache only write them out again.

    notify : (stage, frame number or None, share of the stage).  warn : one line for a person.
    workers : who shares the work; None takes those of the job: a cluster, or as many processes as there are cores. The results
    are the same.
    sequence : what `job_sequence` gives for the job, where the caller has it already.
    group_ready : called with the index of each group once the output folder holds what plays it.
    Raises RefMeshError, in plain words, when the job cannot be done, and what `notify` raises.
    """
    sequence = sequence or job_sequence(spec)
    with nullcontext(workers) if workers else own_workers(spec, warn) as own:
        if spec.until == CHECK:
            check_sequence(spec, sequence, notify, own)
        else:
            _run_stages(spec, replace(Context.open(spec, sequence, notify, warn, own), group_ready=group_ready))


def compute(spec: JobSpec, sequence: Sequence, notify: Notify, warn: Callable[[str], None], step: Part | str) -> None:
    """Does a step of a job, as `job_steps` lists them, or a part of one: fills the cache, and writes no results.

    step : a part of one that is divided, or the name of one that is not: TRACK or REVIEW.
    Raises RefMeshError as `run` does, and where an earlier step is not complete.
    """
    part = step if isinstance(step, Part) else None
    with Workers() as workers, suppress(PartDone):
        context = Context.open(spec, sequence, notify, warn, workers, part)
        tracking = _tracked(context)
        if step == TRACK:
            return
        _, references = _probed(context, tracking, step == REVIEW)
        if step != REVIEW and DEFORMATION in spec.stages:
            deformed = deform(context, tracking, references)
            evaluate(context, deformed)
            color(context, deformed)


def own_workers(spec: JobSpec, warn: Callable[[str], None]) -> Workers | ClusterWorkers:
    """Who does the work of a job."""
    return ClusterWorkers(spec.scheduler, warn) if spec.scheduler else Workers()


def _run_stages(spec: JobSpec, context: Context) -> None:
    parsed_marks(context)  # wrong ones are refused before hours of work
    if REFERENCE in spec.stages:
        check_available(context.settings.reference.reconstruction)
        check_own(context)
    with context.timed(TRACKING):
        tracking = _tracked(context)
        write_tracking(context, tracking)
    if REFERENCE in spec.stages:
        plan, references = _probed(context, tracking, DEFORMATION in spec.stages)
        if DEFORMATION in spec.stages:
            plan, references = _reviewed(context, tracking, plan, references)
        with context.timed(REFERENCE):
            write_references(context, tracking, references, plan.reasons)
    if DEFORMATION in spec.stages:
        with context.timed(DEFORMATION):
            deformed = deform(context, tracking, references, partial(publish_group, context))
            write_playbacks(context, deformed)
            write_visibility_sheets(context, deformed)
            if EVALUATION not in spec.stages:  # otherwise the frames are written once, with the colors of their errors
                write_deformed(context, deformed)
    if EVALUATION in spec.stages:
        with context.timed(EVALUATION):
            write_deformed(context, deformed, evaluate(context, deformed))
    if COLOR in spec.stages:
        with context.timed(COLOR):
            write_colors(context, deformed, color(context, deformed))


def _tracked(context: Context) -> TrackingResult:
    if context.settings.tracking.tracking == "group":
        return track_groups(context)
    return optimize_globally(context, track_sequence(context))


def _probed(context: Context, tracking: TrackingResult, to_probe: bool) -> tuple[SegmentPlan, References]:
    """The runs of frames that share a mesh, with their meshes. What one mesh serves shows only once it is deformed to some frames."""
    with context.timed(REFERENCE):
        plan = first_plan(context, tracking)
        references = make_references(context, tracking, plan.grouped)
    if plan.state == PLANNED and to_probe:
        with context.timed(DEFORMATION):
            plan = cut_by_probes(context, tracking, plan, references)
        with context.timed(REFERENCE):
            references = make_references(context, tracking, plan.grouped)
    return plan, _refined(context, tracking, plan, references)


def _reviewed(context: Context, tracking: TrackingResult, plan: SegmentPlan, references: References) -> tuple[SegmentPlan, References]:
    """The same once all frames are deformed and measured; those that no probe stood for may need other meshes."""
    if plan.state != PROBED:
        return plan, references
    with context.timed(DEFORMATION):
        deformed = deform(context, tracking, references)
    with context.timed(EVALUATION):
        plan = with_own_meshes(context, tracking, plan, references, deformed)
    with context.timed(REFERENCE):
        references = make_references(context, tracking, plan.grouped)
    return plan, _refined(context, tracking, plan, references)


def _refined(context: Context, tracking: TrackingResult, plan: SegmentPlan, references: References) -> References:
    """The meshes of reviewed runs, refined where frames stretch them."""
    if not plan.reviewed:
        return references
    with context.timed(DEFORMATION):
        return refine(context, tracking, references)
