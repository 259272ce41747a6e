"""The stages in order."""

from __future__ import annotations

from collections.abc import Callable

from .session.context import Context, Notify
from .session.job import CHECK, JobSpec
from .session.parallel import Workers
from .stages.check import check_sequence
from .stages.deformation import deform
from .stages.evaluation import evaluate
from .stages.global_rounds import optimize_globally
from .stages.marked_bodies import wanted_apart
from .stages.reference import refer
from .stages.tracking import track_sequence
from .stages.tracking_by_group import track_groups
from .stages.tracking_result import Tracked, write_tracked


def run(spec: JobSpec, notify: Notify, warn: Callable[[str], None], processes: int | None = None) -> None:
    """Runs the stages that are wanted; those whose results are in the cache only write them out again.

    notify : (stage, frame number or None, share of the stage).  warn : one line for a person.
    processes : how many share the work; None takes as many as there are cores. The results are the same.
    Raises RefMeshError, in words, when the job cannot be done, and what `notify` raises.
    """
    with Workers(processes) as workers:
        if spec.until == CHECK:
            check_sequence(spec, notify, workers)
            return
        context = Context.open(spec, notify, warn, workers)
        wanted_apart(context)  # before hours of work
        with context.timed("tracking"):
            tracked = _tracked(context)
            write_tracked(context, tracked)
        if "reference" in spec.stages:
            with context.timed("reference"):
                groups = refer(context, tracked)
        if "deformation" in spec.stages:
            with context.timed("deformation"):
                deformed = deform(context, tracked, groups)
        if "evaluation" in spec.stages:
            with context.timed("evaluation"):
                evaluate(context, deformed)


def _tracked(context: Context) -> Tracked:
    if context.settings.tracking.tracking == "group":
        return track_groups(context)
    return optimize_globally(context, track_sequence(context))
