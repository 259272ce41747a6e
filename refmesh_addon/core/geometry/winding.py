"""How often a closed surface winds around a point: signed crossings of a ray, gathered by the cell of a grid across the rays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..types import TriangleMesh
from .holes import capped
from .mesh import merged
from .ragged import ragged_indices, sorted_by_label

Enclosed = Callable[[np.ndarray], np.ndarray]  # of (N, 3) points: (N,) bool

# Rays run along no axis and no plane that is likely to be modelled, so that they meet no edge or corner.
DIRECTION = np.array([[0.836, -0.472, 0.279], [0.365, 0.855, 0.367], [-0.413, -0.205, 0.887]])
PAIRS_AT_ONCE = 1 << 20  # of points and triangles: bounds the memory


class Winding:
    """Built once from a closed surface, triangles counter-clockwise from outside; asked often."""

    def __init__(self, mesh: TriangleMesh):
        self._origin, self._frame = mesh.vertices.mean(axis=0), np.linalg.qr(DIRECTION.T)[0]
        self._vertices, self._triangles = self._turned(mesh.vertices), mesh.triangles
        self._columns = _Columns(self._vertices, mesh.triangles)

    def of(self, points: np.ndarray) -> np.ndarray:
        """(N,) int for (N, 3) points, none of them on the surface: 0 outside, 1 inside, 2 where two parts of it run into each other."""
        points = self._turned(np.asarray(points, dtype=np.float64))
        result = np.zeros(len(points), dtype=np.int64)
        cells, counts = self._columns.of(points)
        batch = np.cumsum(counts) // PAIRS_AT_ONCE
        for number in np.unique(batch):
            chosen = np.flatnonzero(batch == number)
            which, place = ragged_indices(counts[chosen])
            triangle = self._columns.triangles[self._columns.starts[cells[chosen[which]]] + place]
            crossed = _crossed(self._vertices, self._triangles[triangle], points[chosen[which]])
            result[chosen] = np.bincount(which, crossed, len(chosen))
        return result

    def _turned(self, points: np.ndarray) -> np.ndarray:
        return (points - self._origin) @ self._frame


def enclosed_by(mesh: TriangleMesh) -> Enclosed:
    """Tells of points whether they lie in what a capture encloses, its holes closed. Inside-out patches enclose as well."""
    winding = Winding(capped(merged(mesh)[0]))
    return lambda points: winding.of(points) != 0


class _Columns:
    """Which triangles lie above or below each cell of a square grid.

    triangles : cell after cell.  starts : where in it each cell begins.
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray):
        self._side = max(1, int(np.sqrt(len(triangles))))
        self._low = vertices[:, :2].min(axis=0)
        self._cell = np.maximum(np.ptp(vertices[:, :2], axis=0), np.finfo(float).tiny) / self._side
        corners = self._places(vertices).T[:, triangles.T]
        low, high = corners.min(axis=1), corners.max(axis=1)
        _, wide = size = high - low + 1
        owner, place = ragged_indices(size.prod(axis=0))
        down, across = np.divmod(place, wide[owner])
        cell = (low[0, owner] + down) * self._side + low[1, owner] + across
        order, self.starts = sorted_by_label(cell, self._side**2)
        self.triangles = owner[order]

    def of(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cell of each point and how many triangles that has; a point beside all of them has none."""
        places = self._places(points)
        cells = places[:, 0] * self._side + places[:, 1]
        return cells, self.starts[cells + 1] - self.starts[cells]

    def _places(self, points: np.ndarray) -> np.ndarray:
        return np.clip((points[:, :2] - self._low) / self._cell, 0, self._side - 1).astype(np.int64)


def _crossed(vertices: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N,) 1 where the ray upward from a point leaves through its triangle, -1 where it enters, else 0."""
    a, b, c = (vertices[corner] - points for corner in triangles.T)
    sides = [first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] for first, second in ((b, c), (c, a), (a, b))]
    signs = np.sign(sides)
    through = np.abs(signs.sum(axis=0)) == 3
    height = sides[0] * a[:, 2] + sides[1] * b[:, 2] + sides[2] * c[:, 2]  # times the sum of the sides
    return np.where(through & (height * signs[0] > 0), signs[0], 0.0)
