"""Oriented points of many aligned frames of an open take, fused to the union of what the frames show.

Each frame ends elsewhere, so a plain collection of all points holds rims in the middle of what other frames show. Here points are averaged
in cells of a grid, so that the memory depends on the surface and not on the number of frames, and parts that few frames show count as
much as the others. A rim beyond which another frame goes on is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.vectors import normalized, row_dot
from ..types import FrozenArrays

OPPOSITE = -0.5  # cosine of the normals of the two sides of a sheet, at most
CANDIDATES = 8  # nearest points that face about the other way, among which the other side of a sheet is searched
RIM = 2.0  # thicknesses within which a point of a sheet has the other side behind it; at a rim there is none
BEYOND, NEAR = 1.0, 0.75  # thicknesses: how far outside a rim another frame's sheet is searched, and how near there it has to be


@dataclass(frozen=True)
class UnionPoints(FrozenArrays):
    """points, normals : (P, 3).  shown : (P,) share of the points of each cell that lie on what a frame shows, 0 to 1."""

    points: np.ndarray
    normals: np.ndarray
    shown: np.ndarray

    def where(self, chosen: np.ndarray) -> UnionPoints:
        """Those marked in (P,) bool `chosen`."""
        return UnionPoints(self.points[chosen], self.normals[chosen], self.shown[chosen])


class PointUnion:
    """Collects oriented points, frame by frame.  cell : side of the cells in which they are averaged, scene units."""

    def __init__(self, cell: float):
        self._cell = cell
        self._keys, self._sums = np.empty((0, 4), dtype=np.int64), np.empty((0, 8))

    def add(self, points: np.ndarray, normals: np.ndarray, shown: np.ndarray) -> None:
        """points, normals : (P, 3) of a frame.  shown : (P,) bool, on its surface, not on what closes it."""
        keys = np.column_stack([np.floor(points / self._cell).astype(np.int64), _sides(normals)])
        rows = np.column_stack([points, normals, shown, np.ones(len(points))])
        self._keys, self._sums = _summed(np.concatenate([self._keys, keys]), np.concatenate([self._sums, rows]))

    def points(self) -> UnionPoints:
        """The mean of each cell."""
        counts = self._sums[:, 7:]
        return UnionPoints(self._sums[:, :3] / counts, normalized(self._sums[:, 3:6]), (self._sums[:, 6:7] / counts)[:, 0])


def _sides(normals: np.ndarray) -> np.ndarray:
    """(P,) number of the axis and the sign that each normal is nearest to: the two sides of a sheet in one cell stay apart."""
    axis = np.abs(normals).argmax(axis=1)
    return 2 * axis + (np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] < 0)


def _summed(keys: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    order = np.lexsort(keys.T[::-1])
    keys, rows = keys[order], rows[order]
    starts = np.flatnonzero(np.concatenate([[True], (np.diff(keys, axis=0) != 0).any(axis=1)])) if len(keys) else np.zeros(0, int)
    return keys[starts], np.add.reduceat(rows, starts) if len(keys) else rows


def without_inner_rims(union: UnionPoints) -> UnionPoints:
    """The points but for those on a rim that another frame's sheet goes beyond."""
    behind = distances_behind(union.points, union.normals)
    thickness = sheet_thickness(behind)
    rim = behind > RIM * thickness
    if rim.all() or not rim.any():
        return union
    ahead = union.points[rim] + BEYOND * thickness * union.normals[rim]
    covered = np.isfinite(cKDTree(union.points[~rim]).query(ahead, distance_upper_bound=NEAR * thickness)[0])
    rim[rim] = covered
    return union.where(~rim)


def sheet_thickness(behind: np.ndarray) -> float:
    """Median distance between the two sides of a layer, scene units.  behind : (P,) `distances_behind` of points on it."""
    return float(np.median(behind[np.isfinite(behind)])) if np.isfinite(behind).any() else 0.0


def distances_behind(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(P,) distance from each point to the nearest one behind it that faces the other way; inf where none of those tried does."""
    side, result = _sides(normals), np.full(len(points), np.inf)
    for number in range(6):
        own, opposite = np.flatnonzero(side == number), np.flatnonzero(side == number ^ 1)
        if not len(own) or not len(opposite):
            continue
        distances, near = cKDTree(points[opposite]).query(points[own], k=np.arange(1, min(CANDIDATES, len(opposite)) + 1))
        for rank in range(near.shape[1] - 1, -1, -1):
            other = opposite[near[:, rank]]
            facing = row_dot(normals[own], normals[other]) < OPPOSITE
            behind = facing & (row_dot(points[other] - points[own], normals[own]) < 0)
            result[own[behind]] = distances[behind, rank]
    return result
