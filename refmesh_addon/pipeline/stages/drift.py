"""Drift removed by color: part of the deformation stage, between the fit of the frames and their smoothing, where it is switched on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...core.color.drift_chain import carried
from ...core.color.drift_removal import Slide
from ...core.color.layout import Layout
from ...core.deformation.deformer import DeformedFrame
from ...core.types import TriangleMesh
from ..session.cache import digest
from ..session.cached_map import WorkUnit, cached_map
from ..session.context import Context
from ..session.job import DEFORMATION
from ..session.stage_share import StageShare
from .color_survey import FrameColors, survey
from .color_units import GroupLayout
from .drift_units import ColoredFrame, ColoredReference, StepLayout, slide_from_neighbor
from .groups import FrameGroup
from .reference import References
from .texture_layouts import texture_layouts

DRIFT_SCHEMA = 2
# Parts of the stage's time, roughly; the frames are fitted before, and smoothed after.
FITTING, SURVEYING, LAYING_OUT, STEPPING, SLIDING = (
    StageShare(DEFORMATION, *part) for part in ((0.0, 0.3), (0.3, 0.32), (0.32, 0.36), (0.36, 0.55), (0.55, 0.95))
)


@dataclass(frozen=True)
class Fitted:
    """units : with which frames were deformed.  frames : as deformed. Both by index of the group and of the frame."""

    units: Mapping[tuple[int, int], WorkUnit]
    frames: Mapping[tuple[int, int], DeformedFrame]


@dataclass(frozen=True)
class DriftRemoval:
    """groups : with keys of their frames without drift.  units : by index of the group and of the frame."""

    groups: list[FrameGroup]
    units: dict[tuple[int, int], WorkUnit]


def drift_removal(context: Context, references: References, groups: list[FrameGroup], fitted: Fitted) -> DriftRemoval | None:
    """The work that removes drift; None where no frame has color. What its units need is computed here."""
    silent = replace(context, warn=lambda line: None)  # the stage of color says what is wrong
    colors = survey(silent, SURVEYING)
    if not any(frame.colored for frame in colors.values()):
        return None
    layouts = texture_layouts(silent, references.extended, LAYING_OUT)
    groups = [replace(group, key=_key(group, colors, layouts)) for group in groups]
    takes = [_Take(context, references, group, fitted, compared_frame(group, references, colors), layouts) for group in groups]
    steps = {at: unit for take in takes for at, unit in take.steps().items()}
    slides = cached_map(context, slide_from_neighbor, steps, Slide, STEPPING)
    return DriftRemoval(groups, {at: unit for take in takes for at, unit in take.units(slides).items()})


@dataclass(frozen=True)
class _Take:
    """The frames of one group.  anchor : index of the frame whose picture the others are compared with."""

    context: Context
    references: References
    group: FrameGroup
    fitted: Fitted
    anchor: int
    layouts: Mapping[int, GroupLayout]

    @property
    def mesh(self) -> TriangleMesh:
        return self.references.meshes[self.group.index].mesh

    @property
    def layout(self) -> Layout:
        layout = self.layouts[self.group.index].layout
        return Layout(layout.uvs, layout.triangles[: len(self.mesh.triangles)])  # transient pieces come after the mesh's own

    def outward(self) -> list[tuple[int, int]]:
        """The frames but the anchor, each with its neighbor toward it, the nearest first."""
        frames = self.group.reached
        middle = frames.index(self.anchor)
        rows = sorted((row for row in range(len(frames)) if row != middle), key=lambda row: abs(row - middle))
        return [(frames[row], frames[row + (1 if row < middle else -1)]) for row in rows]

    def colored(self, frame: int) -> ColoredFrame:
        frames = self.context.frames
        return ColoredFrame(self.fitted.frames[self.group.index, frame], frames.surface(frame), frames.path(frame))

    def steps(self) -> dict[tuple[int, int], WorkUnit]:
        """Slides from neighbor to neighbor."""
        shared = lambda: StepLayout(self.group.key, self.mesh, self.layout)
        arguments = lambda frame, neighbor: lambda: (shared(), self.colored(neighbor), self.colored(frame))
        return {(self.group.index, frame): self._unit("step_", frame, arguments(frame, other)) for frame, other in self.outward()}

    def units(self, slides: Mapping[tuple[int, int], Slide]) -> dict[tuple[int, int], WorkUnit]:
        """The removal of drift.  slides : those from neighbor to neighbor."""
        chain = DriftChain(self.mesh, self.group.index, self.fitted.frames, slides, dict(self.outward()))
        order = [self.anchor, *(frame for frame, _ in self.outward())]
        return {(self.group.index, frame): self._unit("undrifted_", frame, self._arguments(frame, chain)) for frame in order}

    def _arguments(self, frame: int, chain: DriftChain) -> Callable[[], tuple]:
        def arguments() -> tuple:
            reference, targets, _, centers = self.fitted.units[self.group.index, frame].arguments()
            anchor = self.colored(self.anchor)
            shared = ColoredReference(self.group.key, reference, self.layout, anchor.frame, anchor.surface, anchor.path)
            return shared, self.colored(frame), chain.at(frame), targets, centers

        return arguments

    def _unit(self, prefix: str, frame: int, arguments: Callable[[], tuple]) -> WorkUnit:
        fitting = self.fitted.units[self.group.index, frame]
        return WorkUnit(fitting.entry.replace("deformation/", f"deformation/{prefix}"), self.group.key, arguments, fitting.frame)


class DriftChain:
    """Where the skin of a group's anchor frame is in the others: the slides between neighbors, one after the other.

    before : by frame, its neighbor toward the anchor. Only the latest frame on either side is kept: those nearest to the anchor come first.
    """

    def __init__(
        self,
        mesh: TriangleMesh,
        group: int,
        fitted: Mapping[tuple[int, int], DeformedFrame],
        slides: Mapping[tuple[int, int], Slide],
        before: Mapping[int, int],
    ):
        self._mesh, self._group, self._fitted, self._slides, self._before = mesh, group, fitted, slides, before
        self._latest: dict[int, np.ndarray] = {}

    def at(self, frame: int) -> np.ndarray:
        """(R, 3) places of the anchor frame's vertices, scene units."""
        way = []
        while frame not in self._latest and frame in self._before:
            way.append(frame)
            frame = self._before[frame]
        places = self._latest.get(frame)
        if places is None:
            places = self._fitted[self._group, frame].vertices
        for following in reversed(way):
            neighbor = self._mesh.moved(self._fitted[self._group, frame].vertices)
            places = carried(places, neighbor, self._slides[self._group, following].vertices)
            self._latest.pop(frame, None)
            self._latest[following] = places
            frame = following
        return places


def compared_frame(group: FrameGroup, references: References, colors: Mapping[int, FrameColors]) -> int:
    """Index of the frame whose picture those of a group are compared with: the one with color that is nearest to the anchor frame."""
    anchor = group.source[references.centers[group.index].anchor]
    return min(group.frames, key=lambda frame: (not colors[frame].colored, abs(frame - anchor), frame))


def _key(group: FrameGroup, colors: Mapping[int, FrameColors], layouts: Mapping[int, GroupLayout]) -> str:
    layout = layouts[group.index].layout
    contents = [colors[frame].content for frame in group.reached]
    return digest(DRIFT_SCHEMA, group.key, contents, layout.uvs.tobytes(), layout.triangles.tobytes())
