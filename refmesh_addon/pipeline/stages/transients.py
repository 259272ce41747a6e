"""Transient pieces in the meshes of their groups: shown as captured in their own frame, shrunk to a point of the surface in all others.

So they are in every playback and export, of which the topology is constant, and no frame shows what its capture does not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ...core.geometry.mesh import triangle_areas, vertex_components
from ...core.reference.group import ReferenceMesh
from ...core.types import FrozenArrays, TriangleMesh
from ...io.frame_range import format_frames
from ...io.report import TransientReport
from ..session.context import Context
from .groups import FrameGroup

MOST = 0.5  # of the triangle budget of a mesh, which its transient pieces may have together; the largest frames' worth comes first


@dataclass(frozen=True)
class GroupTransients(FrozenArrays):
    """The transient pieces that the mesh of a group has beside the reference mesh.

    mesh : all of them where they were captured.  piece : (V,) number of each vertex's piece.  frame : (V,) index of the frame it is of.
    """

    mesh: TriangleMesh
    piece: np.ndarray
    frame: np.ndarray

    def extended(self, mesh: TriangleMesh) -> TriangleMesh:
        """The reference mesh with the pieces after its own vertices and triangles."""
        triangles = np.concatenate([mesh.triangles, self.mesh.triangles + len(mesh.vertices)])
        return TriangleMesh(np.concatenate([mesh.vertices, self.mesh.vertices]), triangles)

    def nearest(self, vertices: np.ndarray, frame: int) -> dict[int, int]:
        """Number of each piece of a frame -> the vertex nearest to it, of the deformed reference mesh in that frame, (R, 3)."""
        tree, own = cKDTree(vertices), np.unique(self.piece[self.frame == frame])
        return {int(piece): int(tree.query(self.mesh.vertices[self.piece == piece].mean(axis=0))[1]) for piece in own}

    def placed(self, vertices: np.ndarray, frame: int, anchors: np.ndarray) -> np.ndarray:
        """(R + V, 3) vertices of the whole mesh in a frame.

        vertices : (R, 3) of the deformed reference mesh there.  anchors : (V,) those to which the pieces of other frames shrink.
        """
        shown = (self.frame == frame)[:, None]
        return np.concatenate([vertices, np.where(shown, self.mesh.vertices, vertices[anchors])])


class ExtendedMeshes(Mapping[int, ReferenceMesh]):
    """Reference meshes by index of the group, with the transient pieces of their frames."""

    def __init__(self, meshes: Mapping[int, ReferenceMesh], transients: Mapping[int, GroupTransients]):
        self._meshes, self._transients = meshes, transients

    def __getitem__(self, index: int) -> ReferenceMesh:
        bare, own = self._meshes[index], self._transients.get(index)
        return bare if own is None else replace(bare, mesh=own.extended(bare.mesh))

    def __iter__(self) -> Iterator[int]:
        return iter(self._meshes)

    def __len__(self) -> int:
        return len(self._meshes)


def group_transients(context: Context, group: FrameGroup, budget: int) -> GroupTransients | None:
    """The transient pieces of a group's frames, None where there are none.  budget : triangles of the reference mesh."""
    meshes = {frame: context.frames.transient(frame) for frame in group.frames if frame in context.frames.transients}
    left = MOST * budget
    for frame in sorted(meshes, key=lambda frame: -triangle_areas(meshes[frame]).sum()):
        left -= len(meshes[frame].triangles)
        if left < 0:
            del meshes[frame]
    if not meshes:
        return None
    counts = [len(mesh.vertices) for mesh in meshes.values()]
    starts = np.cumsum([0, *counts[:-1]])
    triangles = np.concatenate([mesh.triangles + start for mesh, start in zip(meshes.values(), starts, strict=True)])
    whole = TriangleMesh(np.concatenate([mesh.vertices for mesh in meshes.values()]), triangles)
    return GroupTransients(whole, vertex_components(whole)[1], np.repeat(list(meshes), counts))


def report_transients(context: Context, transients: Mapping[int, GroupTransients]) -> None:
    """Every frame with transient pieces in the report, and one warning for all of them."""
    shown = {int(frame) for own in transients.values() for frame in np.unique(own.frame)}
    context.report.transients = [_entry(context, frame, frame in shown) for frame in context.frames.transients]
    for is_shown, what in ((True, "shown as captured there and nowhere else"), (False, "left out")):
        numbers = [entry.frame for entry in context.report.transients if entry.shown == is_shown]
        if numbers:
            which = format_frames(numbers, context.numbers)
            context.warn(f"{which}: pieces that are there for a few frames only are not followed; they are {what}")


def _entry(context: Context, frame: int, shown: bool) -> TransientReport:
    mesh = context.frames.transient(frame)
    area = triangle_areas(mesh).sum() / triangle_areas(context.frames.mesh(frame)).sum()
    count = len(context.frames.transients[frame])
    return TransientReport(context.numbers[frame], count, tuple(mesh.vertices.mean(axis=0).tolist()), float(area), shown)
