"""Where a mesh that is carried to other positions tears, and how what is left is closed again."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..geometry.borders import boundary_edges
from ..geometry.holes import capped
from ..types import TriangleMesh

TORN_RATIO = 2.0  # an edge stretched beyond this ...
TORN_LENGTH = 0.3  # ... and by more than this many s spans a tear; short edges may stretch by rounding alone


class Tears:
    """What is needed of a mesh before it moves, computed once for all positions that it is carried to."""

    def __init__(self, mesh: TriangleMesh, spacing: float):
        """spacing : s, scene units."""
        self._mesh, self._spacing = mesh, spacing

    def whole(self, vertices: np.ndarray) -> np.ndarray:
        """(T,) bool, triangles that do not span a tear when the vertices are at these (V, 3) positions."""
        before, after = self._lengths, _side_lengths(vertices, self._mesh.triangles)
        return ~((after > TORN_RATIO * before) & (after - before > TORN_LENGTH * self._spacing)).any(axis=0)

    def closed(self, carried: TriangleMesh, whole: np.ndarray) -> TriangleMesh:
        """The carried mesh with caps in place of triangles that are not marked in (T,) bool `whole`, and on holes that it had before."""
        if whole.all() and not self._has_holes:
            return carried
        return capped(TriangleMesh(carried.vertices, carried.triangles[whole]))

    @cached_property
    def _lengths(self) -> np.ndarray:
        return _side_lengths(self._mesh.vertices, self._mesh.triangles)

    @cached_property
    def _has_holes(self) -> bool:
        return len(boundary_edges(self._mesh)) > 0


def torn(mesh: TriangleMesh, mapped: np.ndarray, spacing: float) -> np.ndarray:
    """(T,) bool, triangles of which a side is stretched so far by (V, 3) mapped positions that it spans a tear."""
    return ~Tears(mesh, spacing).whole(mapped)


def _side_lengths(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(3, T) lengths of the sides of triangles."""
    axes = np.ascontiguousarray(vertices.T)
    a, b, c = (axes.take(corner, axis=1) for corner in triangles.T)
    return np.sqrt([x * x + y * y + z * z for x, y, z in (b - a, c - b, a - c)])
