"""Enclosed volume of a frame as a voxel grid, filled by signed scan lines.

A triangle is rasterised onto the grid's cell columns and adds its orientation at its depth; the running sum along the
column is the winding number of each cell. Holes are capped first, so that every column ends at zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..types import FrozenArrays, TriangleMesh
from .holes import capped
from .ragged import ragged_indices

PAIRS_AT_ONCE = 2_000_000  # triangle-column pairs rasterised together: bounds the memory of one batch to about 200 MB


@dataclass(frozen=True)
class Grid(FrozenArrays):
    """Cells of a regular grid.

    origin : (3,) lowest corner, scene units.  spacing : edge of a cell, scene units.  shape : cells along x, y, z.
    """

    origin: np.ndarray
    spacing: float
    shape: tuple[int, int, int]

    def positions(self, inside: np.ndarray) -> np.ndarray:
        """Centers of the marked cells of a boolean grid, (N, 3) scene units."""
        return self.origin + (np.argwhere(inside) + 0.5) * self.spacing


def grid_around(vertices: np.ndarray, resolution: int) -> Grid:
    """The grid over the bounding box of (V, 3) vertices whose longest side has `resolution` cells.

    Raises ValueError when the vertices span no length.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    longest = float((high - low).max())
    if not longest > 0:
        raise ValueError("vertices span no length, so there is nothing to fill")
    spacing = longest / resolution
    shape = np.maximum(np.ceil((high - low) / spacing - 1e-9), 1).astype(int)
    x, y, z = (int(count) for count in shape)
    return Grid((low + high) / 2 - shape * spacing / 2, spacing, (x, y, z))


def fill(mesh: TriangleMesh, grid: Grid) -> np.ndarray:
    """Cells of `grid` whose center lies inside the mesh, boolean of grid.shape.

    A cell is inside when its winding number is not zero: inside-out meshes and flipped patches enclose what they would
    the right way round, and an inner surface that faces inward leaves a cavity.
    """
    body = capped(mesh)
    corners = (body.vertices - grid.origin) / grid.spacing - 0.5
    rows, columns, depth = grid.shape
    steps = np.zeros((rows, columns, depth + 1), dtype=np.int8)
    for row, column, height, sign in _crossings(corners, body.triangles, rows, columns):
        level = np.clip(np.ceil(height), 0, depth).astype(np.int64)
        np.add.at(steps.reshape(-1), (row * columns + column) * (depth + 1) + level, sign)
    np.cumsum(steps, axis=2, out=steps)
    return steps[:, :, :depth] != 0


def _crossings(corners: np.ndarray, triangles: np.ndarray, rows: int, columns: int):
    """Yields batches (row, column, height, sign) of scan lines through triangles; sign is +1 where the line enters."""
    corner = corners[triangles]
    low = np.maximum(np.ceil(corner[:, :, :2].min(axis=1)), 0).astype(np.int64)
    high = np.minimum(np.floor(corner[:, :, :2].max(axis=1)), [rows - 1, columns - 1]).astype(np.int64)
    size = np.maximum(high - low + 1, 0)
    pairs = size[:, 0] * size[:, 1]
    batch = np.cumsum(pairs) // PAIRS_AT_ONCE
    for number in np.unique(batch):
        chosen = np.flatnonzero((batch == number) & (pairs > 0))
        if len(chosen):
            yield _rasterised(corner[chosen], triangles[chosen], low[chosen], size[chosen])


def _rasterised(corner, triangles, low, size):
    pairs = size[:, 0] * size[:, 1]
    owner, place = ragged_indices(pairs)
    row = low[owner, 0] + place // size[owner, 1]
    column = low[owner, 1] + place % size[owner, 1]
    ccw, cw = np.ones(len(owner), bool), np.ones(len(owner), bool)
    for start, end in ((0, 1), (1, 2), (2, 0)):
        left = _left_of_edge(corner, triangles, start, end, owner, row, column)
        ccw &= left
        cw &= ~left
    hit = np.flatnonzero(ccw | cw)
    owner, row, column = owner[hit], row[hit], column[hit]
    a = corner[:, 0]
    normal = np.cross(corner[:, 1] - a, corner[:, 2] - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = -normal[:, :2] / normal[:, 2:]
    height = a[owner, 2] + slope[owner, 0] * (row - a[owner, 0]) + slope[owner, 1] * (column - a[owner, 1])
    # A triangle seen edge-on that still catches a scan line by rounding has no slope: its own corner height will do.
    height = np.clip(np.where(np.isfinite(height), height, a[owner, 2]), corner[owner, :, 2].min(axis=1), corner[owner, :, 2].max(axis=1))
    return row, column, height, np.where(ccw[hit], -1, 1).astype(np.int8)


def _left_of_edge(corner, triangles, start, end, owner, row, column):
    """Whether each scan line is left of its triangle's edge.

    The edge is always evaluated from its lower vertex index, so that the two triangles at an edge get the same number
    with opposite meaning and a line through the edge hits exactly one of them. A line through a corner is taken as moved
    by a hair along -x, and by a hair of that along y, the same for all edges there, so that it too hits one of them.
    """
    swapped = triangles[:, start] > triangles[:, end]
    first = np.where(swapped[:, None], corner[:, end, :2], corner[:, start, :2])
    along = np.where(swapped[:, None], corner[:, start, :2], corner[:, end, :2]) - first
    cross = along[owner, 0] * (column - first[owner, 1]) - along[owner, 1] * (row - first[owner, 0])
    tie = (along[:, 1] > 0) | ((along[:, 1] == 0) & (along[:, 0] > 0))
    return ((cross > 0) | ((cross == 0) & tie[owner])) != swapped[owner]
