"""The work on one frame whose drift is removed by color, as worker processes do it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.color.drift_removal import AnchorPicture, Canvas, Slide, View
from ...core.color.layout import Layout
from ...core.deformation.deformer import DeformedFrame, GroupReference, ReferenceDeformer
from ...core.geometry.closest_point import SurfaceIndex
from ...core.geometry.mesh import mean_edge_length
from ...core.latest import latest_only
from ...core.types import Keyed, TriangleMesh
from ...io.appearance import parse_appearance
from ...io.meshes import read_bytes

STEP_SIZE = 512  # texels along a side of the pictures of neighbors: they only say about where vertices go
WORST = 1.05  # of the distance to the source before, above which a frame stays as it was


@dataclass(frozen=True, eq=False)
class ColoredReference(Keyed):
    """A group's reference mesh and the frame whose picture the others are compared with.

    layout : of the mesh.  anchor : that frame as deformed.  source : its surface.  path : of its file.
    """

    key: str
    reference: GroupReference
    layout: Layout
    anchor: DeformedFrame
    source: TriangleMesh
    path: Path


@dataclass(frozen=True)
class UndriftedFrame(DeformedFrame):
    """A deformed frame after its drift was removed.

    agreeing : share of vertices whose picture agrees with that of the anchor frame once they have moved.
    slide : mean way that vertices have moved, mean edge lengths.
    distance_before, distance_after : mean of vertices that the capture shows from the source, shares of the diagonal.
    """

    agreeing: float = 0.0
    slide: float = 0.0
    distance_before: float = 0.0
    distance_after: float = 0.0


@dataclass(frozen=True)
class ColoredFrame:
    """frame : as deformed.  surface : its source.  path : of its file."""

    frame: DeformedFrame
    surface: TriangleMesh
    path: Path


@dataclass(frozen=True, eq=False)
class StepLayout(Keyed):
    """layout : of a group's reference mesh."""

    key: str
    mesh: TriangleMesh
    layout: Layout


def slide_from_neighbor(shared: StepLayout, neighbor: ColoredFrame, own: ColoredFrame) -> Slide:
    """A frame with its vertices moved to where its neighbor has the same colors."""
    views = [_view(shared.mesh, side) for side in (neighbor, own)]
    if views[0] is None or views[1] is None:
        return Slide(own.frame.vertices, np.zeros(len(own.frame.vertices), bool))
    return AnchorPicture(_canvas(shared), views[0]).without_drift(views[1])


@latest_only
def _canvas(shared: StepLayout) -> Canvas:
    return Canvas(shared.mesh, shared.layout, STEP_SIZE)


def _view(mesh: TriangleMesh, own: ColoredFrame) -> View | None:
    """None for a frame without color."""
    appearance = parse_appearance(read_bytes(own.path), own.path)[0]
    return None if appearance is None else View(mesh.moved(own.frame.vertices), _blind(own.frame), own.surface, appearance)


def remove_drift(
    shared: ColoredReference, own: ColoredFrame, guess: np.ndarray, targets: np.ndarray, centers: np.ndarray
) -> UndriftedFrame:
    """A deformed frame with its vertices moved to where the anchor frame has the same colors, and on its source again.

    It stays as it was where no colors agree, and where it would be farther from its source.
    guess : (R, 3) about where the vertices go.  targets, centers : with which the frame was deformed.
    """
    prepared, frame, mesh = _prepared(shared), own.frame, shared.reference.mesh
    view = _view(mesh, own) if prepared.picture is not None else None
    if prepared.picture is None or view is None:
        return _undrifted(frame)
    slide = prepared.picture.without_drift(view, guess, slides=1)
    source = SurfaceIndex(own.surface)
    before = _distance(frame, source)
    if not slide.agreeing.any():
        return _undrifted(frame, distance_before=before, distance_after=before)
    result = prepared.deformer.fitted_again(frame, slide.vertices, slide.agreeing, targets, own.surface, centers)
    after = _distance(result, source)
    if after > WORST * before:
        return _undrifted(frame, distance_before=before, distance_after=before)
    moved = np.linalg.norm(result.vertices - frame.vertices, axis=1).mean() / mean_edge_length(mesh)
    return _undrifted(result, agreeing=float(slide.agreeing.mean()), slide=float(moved), distance_before=before, distance_after=after)


@dataclass(frozen=True)
class _Prepared:
    deformer: ReferenceDeformer
    picture: AnchorPicture | None


@latest_only
def _prepared(shared: ColoredReference) -> _Prepared:
    deformer, mesh = ReferenceDeformer(shared.reference), shared.reference.mesh
    anchor = _view(mesh, ColoredFrame(shared.anchor, shared.source, shared.path))
    return _Prepared(deformer, None if anchor is None else AnchorPicture(Canvas(mesh, shared.layout), anchor))


def _blind(frame: DeformedFrame) -> np.ndarray:
    return frame.hidden | frame.held | frame.absent


def _distance(frame: DeformedFrame, source: SurfaceIndex) -> float:
    shown = frame.vertices[~_blind(frame)]
    return float(source.query(shown).distances.mean() / source.mesh.diagonal) if len(shown) else 0.0


def _undrifted(frame: DeformedFrame, **figures: float) -> UndriftedFrame:
    return UndriftedFrame(**vars(frame), **figures)
