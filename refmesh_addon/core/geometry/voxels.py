"""Voxelization of the volume that a frame encloses, by signed scan conversion.

Each triangle is rasterized onto the columns of the grid and adds its orientation at its depth; the running sum along a column is the
winding number of each voxel. Holes are capped first, so that every column ends at zero.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..types import FrozenArrays, TriangleMesh
from .holes import capped
from .ragged import ragged_indices

PAIRS_AT_ONCE = 2_000_000  # triangle-column pairs rasterized at a time, which takes some 200 MB
WHOLE = 1e-9  # of a voxel: a side that exceeds a whole number of voxels by less does so by rounding


@dataclass(frozen=True)
class Grid(FrozenArrays):
    """A regular grid of voxels.

    origin : (3,) lowest corner, scene units.  spacing : side of a voxel, scene units.  shape : voxels along x, y, z.
    """

    origin: np.ndarray
    spacing: float
    shape: tuple[int, int, int]

    def positions(self, inside: np.ndarray) -> np.ndarray:
        """Centers of the voxels that are True in a boolean array of the grid's shape, (N, 3) scene units."""
        return self.origin + (np.argwhere(inside) + 0.5) * self.spacing


def grid_around(vertices: np.ndarray, resolution: int) -> Grid:
    """The grid over the bounding box of (V, 3) vertices, with `resolution` voxels along its longest side.

    Raises ValueError when the vertices span no length.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    longest = float((high - low).max())
    if not longest > 0:
        raise ValueError("the vertices span no length, so there is no volume to fill")
    return grid_of(vertices, longest / resolution)


def grid_of(vertices: np.ndarray, spacing: float) -> Grid:
    """The grid over the bounding box of (V, 3) vertices, with voxels of a side of `spacing`, scene units."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    shape = np.maximum(np.ceil((high - low) / spacing - WHOLE), 1).astype(int)
    x, y, z = (int(count) for count in shape)
    return Grid((low + high) / 2 - shape * spacing / 2, spacing, (x, y, z))


def fill(mesh: TriangleMesh, grid: Grid) -> np.ndarray:
    """Voxels whose center lies inside the mesh, its holes capped; a boolean array of grid.shape."""
    return fill_closed(capped(mesh), grid)


def fill_closed(mesh: TriangleMesh, grid: Grid) -> np.ndarray:
    """The same for a mesh that is known to have no holes.

    Inside means a winding number other than zero: inside-out meshes enclose the same volume, and an inner surface that faces inward
    leaves a cavity.
    """
    corners = (mesh.vertices - grid.origin) / grid.spacing - 0.5
    rows, columns, depth = grid.shape
    steps = np.zeros((rows, columns, depth + 1), dtype=np.int8)
    for row, column, height, sign in _crossings(corners, mesh.triangles, rows, columns):
        level = np.clip(np.ceil(height), 0, depth).astype(np.int64)
        np.add.at(steps.reshape(-1), (row * columns + column) * (depth + 1) + level, sign)
    np.cumsum(steps, axis=2, out=steps)
    return steps[:, :, :depth] != 0


def _crossings(corners: np.ndarray, triangles: np.ndarray, rows: int, columns: int) -> Iterator[tuple[np.ndarray, ...]]:
    """Yields batches (row, column, height, sign), (K,) each, of scan lines that cross triangles; sign is 1 where a line enters."""
    corner = corners[triangles]
    a, b, c = corner[:, :, :2].transpose(1, 0, 2)  # by corners: numpy reduces an axis of three slowly
    low = np.maximum(np.ceil(np.minimum(np.minimum(a, b), c)), 0).astype(np.int64)
    high = np.minimum(np.floor(np.maximum(np.maximum(a, b), c)), [rows - 1, columns - 1]).astype(np.int64)
    size = np.maximum(high - low + 1, 0)
    pairs = size[:, 0] * size[:, 1]
    batch = np.cumsum(pairs) // PAIRS_AT_ONCE
    for number in np.unique(batch):
        chosen = np.flatnonzero((batch == number) & (pairs > 0))
        if len(chosen):
            yield _rasterized(corner[chosen], triangles[chosen], low[chosen], size[chosen])


def _rasterized(corner: np.ndarray, triangles: np.ndarray, low: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, ...]:
    """One batch of `_crossings`.  corner : (K, 3, 3) in voxels.  triangles : (K, 3).  low, size : (K, 2) columns of the bounding boxes."""
    pairs = size[:, 0] * size[:, 1]
    owner, entry = ragged_indices(pairs)
    row = low[owner, 0] + entry // size[owner, 1]
    column = low[owner, 1] + entry % size[owner, 1]
    ccw, cw = np.ones(len(owner), bool), np.ones(len(owner), bool)
    for edge in ([0, 1], [1, 2], [2, 0]):
        left = _left_of_edge(corner[:, edge, :2], triangles[:, edge], owner, row, column)
        ccw &= left
        cw &= ~left
    hit = np.flatnonzero(ccw | cw)
    owner, row, column = owner[hit], row[hit], column[hit]
    a = corner[:, 0]
    normal = np.cross(corner[:, 1] - a, corner[:, 2] - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = -normal[:, :2] / normal[:, 2:]
    height = a[owner, 2] + slope[owner, 0] * (row - a[owner, 0]) + slope[owner, 1] * (column - a[owner, 1])
    # A triangle seen edge-on has no slope, and yet rounding may put a scan line in it: there, the height of a corner is right.
    height = np.clip(np.where(np.isfinite(height), height, a[owner, 2]), corner[owner, :, 2].min(axis=1), corner[owner, :, 2].max(axis=1))
    return row, column, height, np.where(ccw[hit], -1, 1).astype(np.int8)


def _left_of_edge(ends: np.ndarray, vertices: np.ndarray, owner: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """(N,) bool, whether each scan line lies to the left of an edge of its triangle.

    ends : (K, 2, 2) start and end of the edges, in voxels.  vertices : (K, 2) their indices.
    owner, row, column : (N,) triangle and column of the grid of each line.

    An edge is always evaluated from the end with the lower index: its two triangles then get the same value with opposite meaning, and
    a line through the edge hits exactly one of them. A line through a vertex counts as displaced infinitesimally along -x, and by an
    infinitesimal share of that along y, the same for all edges there, so that it too hits exactly one triangle.
    """
    swapped = vertices[:, 0] > vertices[:, 1]
    first = np.where(swapped[:, None], ends[:, 1], ends[:, 0])
    along = np.where(swapped[:, None], ends[:, 0], ends[:, 1]) - first
    cross = along[owner, 0] * (column - first[owner, 1]) - along[owner, 1] * (row - first[owner, 0])
    tie = (along[:, 1] > 0) | ((along[:, 1] == 0) & (along[:, 0] > 0))
    return ((cross > 0) | ((cross == 0) & tie[owner])) != swapped[owner]
