"""Drift removed by color: part of the deformation stage, between the fit of the frames and their smoothing, where it is switched on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ...core.color.layout import Layout
from ...core.deformation.deformer import DeformedFrame
from ..session.cache import digest
from ..session.cached_map import WorkUnit
from ..session.context import Context
from ..session.job import DEFORMATION
from ..session.stage_share import StageShare
from .color_survey import FrameColors, survey
from .color_units import GroupLayout
from .drift_units import ColoredReference
from .groups import FrameGroup
from .reference import References
from .texture_layouts import texture_layouts

DRIFT_SCHEMA = 1
# Parts of the stage's time, roughly; the frames are fitted before, and smoothed after.
FITTING, SURVEYING, LAYING_OUT, SLIDING = (StageShare(DEFORMATION, *part) for part in ((0.0, 0.3), (0.3, 0.32), (0.32, 0.36), (0.36, 0.95)))


@dataclass(frozen=True)
class DriftRemoval:
    """groups : with keys of their frames without drift.  colors : of all frames.  layouts : by index of the group."""

    groups: list[FrameGroup]
    colors: Mapping[int, FrameColors]
    layouts: Mapping[int, GroupLayout]

    def unit(
        self,
        context: Context,
        references: References,
        fitting: WorkUnit,
        fitted: Mapping[tuple[int, int], DeformedFrame],
        at: tuple[int, int],
    ) -> WorkUnit:
        """The work on a frame.  fitting : with which it was deformed.  fitted : all frames.  at : indices of its group and the frame."""
        group = self.groups[at[0]]
        anchor = compared_frame(group, references, self.colors)

        def arguments() -> tuple:
            reference, targets, surface, centers = fitting.arguments()
            layout = self.layouts[group.index].layout
            layout = Layout(layout.uvs, layout.triangles[: len(reference.mesh.triangles)])  # transient pieces come after the mesh's own
            frames, path = context.frames, context.frames.path(at[1])
            shared = ColoredReference(
                group.key, reference, layout, fitted[group.index, anchor], frames.surface(anchor), frames.path(anchor)
            )
            return shared, fitted[at], targets, surface, centers, path

        return WorkUnit(fitting.entry.replace("deformation/", "deformation/undrifted_"), group.key, arguments, fitting.frame)


def drift_removal(context: Context, references: References, groups: list[FrameGroup]) -> DriftRemoval | None:
    """What is needed to remove drift; None where no frame has color."""
    silent = replace(context, warn=lambda line: None)  # the stage of color says what is wrong
    colors = survey(silent, SURVEYING)
    if not any(frame.colored for frame in colors.values()):
        return None
    layouts = texture_layouts(silent, references.extended, LAYING_OUT)
    return DriftRemoval([replace(group, key=_key(group, colors, layouts)) for group in groups], colors, layouts)


def compared_frame(group: FrameGroup, references: References, colors: Mapping[int, FrameColors]) -> int:
    """Index of the frame whose picture those of a group are compared with: the one with color that is nearest to the anchor frame."""
    anchor = group.source[references.centers[group.index].anchor]
    return min(group.frames, key=lambda frame: (not colors[frame].colored, abs(frame - anchor), frame))


def _key(group: FrameGroup, colors: Mapping[int, FrameColors], layouts: Mapping[int, GroupLayout]) -> str:
    layout = layouts[group.index].layout
    contents = [colors[frame].content for frame in group.reached]
    return digest(DRIFT_SCHEMA, group.key, contents, layout.uvs.tobytes(), layout.triangles.tobytes())
