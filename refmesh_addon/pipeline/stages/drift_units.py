"""The work on one frame whose drift is removed by color, as worker processes do it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.color.drift_removal import AnchorPicture, View
from ...core.color.layout import Layout
from ...core.deformation.deformer import DeformedFrame, GroupReference, ReferenceDeformer
from ...core.geometry.closest_point import SurfaceIndex
from ...core.geometry.mesh import mean_edge_length
from ...core.latest import latest_only
from ...core.types import Keyed, TriangleMesh
from ...io.appearance import parse_appearance
from ...io.meshes import read_bytes

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


def remove_drift(
    shared: ColoredReference, frame: DeformedFrame, targets: np.ndarray, surface: TriangleMesh, centers: np.ndarray, path: Path
) -> UndriftedFrame:
    """A deformed frame with its vertices moved to where the anchor frame has the same colors, and on its source again.

    It stays as it was where no colors agree, and where it would be farther from its source.
    targets, surface, centers : with which the frame was deformed.  path : of its file.
    """
    prepared = _prepared(shared)
    appearance = parse_appearance(read_bytes(path), path)[0] if prepared.picture is not None else None
    if prepared.picture is None or appearance is None:
        return _undrifted(frame)
    mesh = shared.reference.mesh
    slide = prepared.picture.without_drift(View(mesh.moved(frame.vertices), _blind(frame), surface, appearance))
    source = SurfaceIndex(surface)
    before = _distance(frame, source)
    if not slide.agreeing.any():
        return _undrifted(frame, distance_before=before, distance_after=before)
    result = prepared.deformer.fitted_again(frame, slide.vertices, targets, surface, centers)
    after = _distance(result, source)
    if after > WORST * before:  # further fits would bring it nearer, but fold one triangle in a hundred
        return _undrifted(frame, distance_before=before, distance_after=before)
    moved = np.linalg.norm(result.vertices - frame.vertices, axis=1).mean() / mean_edge_length(mesh)
    return _undrifted(result, agreeing=float(slide.agreeing.mean()), slide=float(moved), distance_before=before, distance_after=after)


@dataclass(frozen=True)
class _Prepared:
    deformer: ReferenceDeformer
    picture: AnchorPicture | None


@latest_only
def _prepared(shared: ColoredReference) -> _Prepared:
    appearance = parse_appearance(read_bytes(shared.path), shared.path)[0]
    deformer = ReferenceDeformer(shared.reference)
    if appearance is None:
        return _Prepared(deformer, None)
    anchor = View(shared.reference.mesh.moved(shared.anchor.vertices), _blind(shared.anchor), shared.source, appearance)
    return _Prepared(deformer, AnchorPicture(shared.layout, anchor))


def _blind(frame: DeformedFrame) -> np.ndarray:
    return frame.hidden | frame.held | frame.absent


def _distance(frame: DeformedFrame, source: SurfaceIndex) -> float:
    shown = frame.vertices[~_blind(frame)]
    return float(source.query(shown).distances.mean() / source.mesh.diagonal) if len(shown) else 0.0


def _undrifted(frame: DeformedFrame, **figures: float) -> UndriftedFrame:
    return UndriftedFrame(**vars(frame), **figures)
