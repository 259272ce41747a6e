"""How well the meshes of groups serve single frames, before the other frames of these groups are deformed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...core.deformation.deformer import DeformedFrame
from ...core.evaluation.segment_limits import FrameFigures, frame_figures, unseen_share
from ...core.types import TriangleMesh
from ..session.cache import digest
from ..session.cached_map import WorkUnit, cached_map
from ..session.context import Context
from .deformation import fit_frames, fitting_groups, smooth_block
from .evaluation import FRAMES
from .reference import References
from .tracking_result import TrackingResult
from .visibility import VISIBILITY_SCHEMA

PROBE_SCHEMA = 1


def probe(
    context: Context, tracking: TrackingResult, references: References, frames: Mapping[int, tuple[int, ...]]
) -> dict[int, FrameFigures]:
    """The figures of some frames of each group, by index of the frame, each fitted by itself.

    frames : by index of the group. What is fitted for this need not be fitted again where the group stays.
    """
    groups, fitted = fitting_groups(context, references), fit_frames(context, tracking, references, frames)

    is_view = context.frames.take is not None
    schema = [PROBE_SCHEMA, VISIBILITY_SCHEMA] if is_view else [PROBE_SCHEMA]

    def unit(index: int, frame: int) -> WorkUnit:
        samples, number = context.settings.evaluation.samples, context.numbers[frame]
        key = digest(*schema, context.frames.keys[frame], groups[index].key, samples)
        arguments = lambda: (references.meshes[index].mesh, fitted[index, frame], context.frames.surface(frame), samples, is_view)
        return WorkUnit(f"{groups[index].folder}evaluation/probe_{number:04d}", key, arguments, number)

    units = {frame: unit(index, frame) for index, chosen in frames.items() for frame in chosen}
    return {frame: counted(context, figures) for frame, figures in cached_map(context, probe_figures, units, FrameFigures, FRAMES).items()}


def counted(context: Context, figures: FrameFigures) -> FrameFigures:
    """What counts of the figures of a frame: of open takes neither what is folded nor what is stretched, which is mostly out of view."""
    return replace(figures, unseen=0.0) if context.frames.take is None else replace(figures, flipped=0.0, overstretched=0.0)


def probe_figures(mesh: TriangleMesh, fitted: DeformedFrame, source: TriangleMesh, samples: int, is_view: bool) -> FrameFigures:
    """How well a mesh serves one frame.

    mesh : the reference.  source : what it was fitted to.  samples : points on the source.  is_view : whether this is part of bodies.
    """
    alone = smooth_block(mesh, [fitted], np.zeros(1), 0)
    figures = frame_figures(mesh, alone.vertices[0], float(alone.flipped[0]), source, samples)
    return replace(figures, unseen=unseen_share(mesh.moved(alone.vertices[0]), source)) if is_view else figures
