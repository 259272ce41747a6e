"""Which points of a group's frames count for its surface over the holes of its anchor frame.

The holes of a capture move: where a foot rolls, its sole is cut off higher or lower, and the walls of one frame reach below the cap of
another. All of them together would be reconstructed as flaps and lumps. So a hole is closed once, by the cap of the anchor frame, and
what the other frames show beyond its rim does not count. But where most of them show a surface that lies along the cap, the hole
is a gap in the anchor frame alone, and their surface counts instead of the cap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np

from ..geometry.borders import border_edges, on_border
from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import triangle_normals
from ..geometry.vectors import row_dot
from ..surfacing.hole_caps import CappedMesh
from ..types import FrozenArrays, TriangleMesh
from .free_space import in_most_frames

REACH = 1.0  # s, farthest from the anchor frame's surface that a point may be to lie over one of its holes
ALONG = 0.5  # least cosine between the normals of a point and of the cap that it lies along
COVERED = 0.5  # share of the other frames that must show a surface in place of a cap, by number of points


@dataclass(frozen=True)
class OrientedPoints(FrozenArrays):
    """P points on the surface of an aligned frame.

    points : (P, 3) scene units.  normals : (P, 3) unit length, outward.  on_cap : (P,) bool, on a cap of the frame's own.
    holes : (P,) int32, the hole of the anchor frame that a point lies over; -1 for none.
    in_free_space : (P,) bool, where the anchor frame shows that there is nothing.
    """

    points: Annotated[np.ndarray, "(P, 3) float64"]
    normals: Annotated[np.ndarray, "(P, 3) float64"]
    on_cap: Annotated[np.ndarray, "(P) bool"]
    holes: Annotated[np.ndarray, "(P) int32"]
    in_free_space: Annotated[np.ndarray, "(P) bool"]

    def where(self, chosen: np.ndarray) -> OrientedPoints:
        """Those that are marked in (P,) bool `chosen`."""
        return OrientedPoints(*(getattr(self, item.name)[chosen] for item in fields(self)))


class HoleFinder:
    """Built once from an anchor frame in reference positions, then tells for points which of its holes they lie over."""

    def __init__(self, anchor: CappedMesh, spacing: float):
        """spacing : s, scene units."""
        self._holes, self._mesh, self._reach = anchor.holes, anchor.mesh, REACH * spacing
        if not self.empty:
            captured = TriangleMesh(self._mesh.vertices, self._mesh.triangles[self._holes < 0])
            self._border = np.zeros((len(self._holes), 3), dtype=bool)
            self._border[self._holes < 0] = border_edges(captured)
            self._index, self._normals = SurfaceIndex(self._mesh), triangle_normals(self._mesh)

    @property
    def empty(self) -> bool:
        """Whether the anchor frame has no holes."""
        return not (self._holes >= 0).any()

    def counted(self, points: np.ndarray, normals: np.ndarray, on_cap: np.ndarray) -> OrientedPoints:
        """Those of (P, 3) points that count, or may count, for the surface, with their holes.  on_cap : (P,) bool.

        Points beyond the rim of a hole, which do not lie along its cap, are left out.
        """
        free = np.zeros(len(points), dtype=bool)
        if self.empty:
            return OrientedPoints(points, normals, on_cap, np.full(len(points), -1, dtype=np.int32), free)
        nearest = self._index.query(points, self._reach)
        holes = np.where(nearest.triangles >= 0, self._holes[nearest.triangles], -1).astype(np.int32)
        along = row_dot(normals, self._normals[nearest.triangles]) > ALONG
        beyond = (nearest.triangles >= 0) & on_border(self._mesh, self._border, nearest.triangles, nearest.points)
        return OrientedPoints(points, normals, on_cap, holes, free).where(np.where(holes >= 0, along, ~beyond))


def counting(frames: Sequence[OrientedPoints], anchor: int, spacing: float) -> list[OrientedPoints]:
    """The points of each frame of a group that count for its surface.

    anchor : index of the anchor frame among them.  spacing : s, scene units.
    """
    count = 1 + max((int(frame.holes.max(initial=-1)) for frame in frames), default=-1)
    capped, shown = np.zeros(count), np.zeros(count)
    for index, frame in enumerate(frames):
        over = frame.holes[(frame.holes >= 0) & (frame.on_cap if index == anchor else ~frame.on_cap)]
        total = capped if index == anchor else shown
        total += np.bincount(over, minlength=count)
    gaps = np.append((shown > 0) & (shown >= COVERED * (len(frames) - 1) * capped), True)  # the last is for points over no hole
    counted = [frame.where(_counts(frame, gaps, index == anchor)) for index, frame in enumerate(frames)]
    shown_by_most = in_most_frames([frame.points[frame.in_free_space] for frame in counted], spacing)
    return [_without_strays(frame, kept) for frame, kept in zip(counted, shown_by_most, strict=True)]


def _without_strays(frame: OrientedPoints, shown_by_most: np.ndarray) -> OrientedPoints:
    """Those that are not in free space, or that most frames show there, as marked in (N,) bool for the N in free space."""
    kept = ~frame.in_free_space
    kept[frame.in_free_space] = shown_by_most
    return frame.where(kept)


def _counts(frame: OrientedPoints, gaps: np.ndarray, anchor: bool) -> np.ndarray:
    """(P,) bool.  gaps : by hole, whether the frames other than the anchor show a surface there."""
    shown = gaps[frame.holes]
    return np.where(frame.on_cap, ~shown, True) if anchor else ~frame.on_cap & shown
