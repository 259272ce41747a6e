"""The steps of a job that a render farm runs one after the other, each divided into tasks that run at the same time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil

from ..session.context import READING_SHARE
from ..session.job import COLOR, DEFORMATION, EVALUATION, REFERENCE, TRACKING, JobSpec
from ..session.stage_share import StageShare
from .color import BAKING, FILES, LAYOUTS, STEADY, SURVEY
from .deformation import BLOCK, SMOOTHING, fitting_share
from .drift import LAYING_OUT, SLIDING, STEPPING, SURVEYING
from .evaluation import FRAMES
from .reference import ALIGNING, BUILDING, PLACING

READING = StageShare(TRACKING, 0.0, READING_SHARE)
TRACKING_GROUPS = StageShare(TRACKING, READING_SHARE)
TRACK, REVIEW, RESULTS = "track", "review", "results"


@dataclass(frozen=True)
class JobStep:
    """name, title : for machines and for people.  share : the place of its units of work in the progress; None for work that one task
    does on all cores of its machine.  units : how many there are, roughly; tasks beyond that have nothing to do.
    """

    name: str
    title: str
    share: StageShare | None = None
    units: int = 1


def job_steps(spec: JobSpec, frames: int) -> tuple[JobStep, ...]:
    """The steps of a job over so many frames, in order. The last one writes all results."""
    return tuple(_steps(spec, frames))


def find_step(spec: JobSpec, name: str) -> JobStep | None:
    """The step of a job by its name; None where the job has no such step."""
    return next((step for step in job_steps(spec, 1) if step.name == name), None)


def _steps(spec: JobSpec, frames: int) -> Iterator[JobStep]:
    reference, stages = spec.settings.reference, spec.stages
    size = reference.group_size or reference.longest_group
    groups = 1 if reference.segments == "long" else ceil(frames / (reference.segment_frames if reference.segments == "frames" else size))
    yield JobStep("read", "Read Frames", READING, frames)
    if spec.settings.tracking.tracking == "group":
        yield JobStep(TRACK, "Track", TRACKING_GROUPS, ceil(frames / size))
    else:
        yield JobStep(TRACK, "Track")
    if REFERENCE in stages:
        yield JobStep("place", "Place Centers", PLACING, groups)
        yield JobStep("align", "Align Frames", ALIGNING, frames)
        yield JobStep("build", "Build Meshes", BUILDING, groups)
    if DEFORMATION in stages:
        if reference.segments == "long":  # what one mesh serves shows only in some deformed frames; where it does not, others are made
            yield JobStep(REVIEW, "Review Meshes")
        yield JobStep("deform", "Deform", fitting_share(spec.settings), frames)
        if spec.settings.color.color_drift != "off":
            yield JobStep("drift_survey", "Survey Colors for Drift", SURVEYING, frames)
            yield JobStep("drift_layout", "Lay Out Textures for Drift", LAYING_OUT, groups)
            yield JobStep("drift_steps", "Compare Neighbors", STEPPING, frames)
            yield JobStep("drift", "Remove Drift", SLIDING, frames)
        yield JobStep("smooth", "Smooth", SMOOTHING, ceil(frames / BLOCK) if groups == 1 else groups)
    if EVALUATION in stages:
        yield JobStep("measure", "Measure", FRAMES, frames)
    if COLOR in stages and spec.settings.color.texture != "off":
        yield JobStep("survey", "Survey Colors", SURVEY, frames)
        yield JobStep("layout", "Lay Out Textures", LAYOUTS, groups)
        yield JobStep("bake", "Bake", BAKING, frames)
        yield JobStep("steady", "Steady Textures", STEADY, groups)
        yield JobStep("textures", "Encode Textures", FILES.part(0.0, 0.9), frames)
    yield JobStep(RESULTS, "Write Results")
