"""Winding numbers of points in a closed surface: signed crossings of a ray, with triangles binned in a grid perpendicular to the rays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..types import TriangleMesh
from .holes import capped
from .mesh import merged
from .ragged import ragged_indices, sorted_by_label
from .vectors import TINY

Enclosed = Callable[[np.ndarray], np.ndarray]  # (N, 3) points -> (N,) bool, whether each is inside

# Rays that are parallel to no axis and no plane that anyone is likely to model, so that they hit no edge or corner.
DIRECTION = np.array([[0.836, -0.472, 0.279], [0.365, 0.855, 0.367], [-0.413, -0.205, 0.887]])
PAIRS_AT_ONCE = 1 << 20  # point-triangle pairs tested at a time, which bounds the memory


class Winding:
    """Winding numbers in one closed surface, its triangles counter-clockwise from outside: built once, queried often."""

    def __init__(self, mesh: TriangleMesh):
        self._origin, self._frame = mesh.vertices.mean(axis=0), np.linalg.qr(DIRECTION.T)[0]
        self._vertices, self._triangles = self._rotated(mesh.vertices), mesh.triangles
        self._columns = _Columns(self._vertices, mesh.triangles)

    def of(self, points: np.ndarray) -> np.ndarray:
        """(N,) int winding numbers of (N, 3) points off the surface: 0 outside, 1 inside, 2 where two parts of it overlap."""
        points = self._rotated(np.asarray(points, dtype=np.float64))
        result = np.zeros(len(points), dtype=np.int64)
        cells, counts = self._columns.of(points)
        batch = np.cumsum(counts) // PAIRS_AT_ONCE
        for number in np.unique(batch):
            chosen = np.flatnonzero(batch == number)
            row, column = ragged_indices(counts[chosen])
            triangle = self._columns.triangles[self._columns.starts[cells[chosen[row]]] + column]
            crossings = _crossings(self._vertices, self._triangles[triangle], points[chosen[row]])
            result[chosen] = np.bincount(row, crossings, len(chosen))
        return result

    def _rotated(self, points: np.ndarray) -> np.ndarray:
        return (points - self._origin) @ self._frame


def nothing_enclosed_by(mesh: TriangleMesh) -> Enclosed:
    """The same test for an open surface, which has no inside."""
    return lambda points: np.zeros(len(points), dtype=bool)


def enclosed_by(mesh: TriangleMesh) -> Enclosed:
    """A test whether points lie inside a capture with its holes capped. Inside-out parts enclose as well."""
    winding = Winding(capped(merged(mesh)[0]))
    return lambda points: winding.of(points) != 0


class _Columns:
    """The triangles above or below each cell of a square grid.

    triangles : cell after cell.  starts : where each cell begins in it.
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray):
        self._side = max(1, int(np.sqrt(len(triangles))))
        self._low = vertices[:, :2].min(axis=0)
        self._cell = np.maximum(np.ptp(vertices[:, :2], axis=0), TINY) / self._side
        corners = self._cells(vertices).T[:, triangles.T]
        low, high = corners.min(axis=1), corners.max(axis=1)
        rows, columns = high - low + 1
        owner, entry = ragged_indices(rows * columns)
        row, column = np.divmod(entry, columns[owner])
        cell = (low[0, owner] + row) * self._side + low[1, owner] + column
        order, self.starts = sorted_by_label(cell, self._side**2)
        self.triangles = owner[order]

    def of(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cell of each point, (N,), and the number of its triangles, (N,)."""
        row, column = self._cells(points).T
        cells = row * self._side + column
        return cells, self.starts[cells + 1] - self.starts[cells]

    def _cells(self, points: np.ndarray) -> np.ndarray:
        return np.clip((points[:, :2] - self._low) / self._cell, 0, self._side - 1).astype(np.int64)


def _crossings(vertices: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N,) 1 where the upward ray from a point leaves through its triangle, -1 where it enters, else 0."""
    a, b, c = (vertices[corner] - points for corner in triangles.T)
    sides = [first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] for first, second in ((b, c), (c, a), (a, b))]
    signs = np.sign(sides)
    through = np.abs(signs.sum(axis=0)) == 3
    height = sides[0] * a[:, 2] + sides[1] * b[:, 2] + sides[2] * c[:, 2]  # times the sum of the sides
    return np.where(through & (height * signs[0] > 0), signs[0], 0.0)
