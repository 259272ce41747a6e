"""How far the triangles of a mesh are stretched against its rest shape."""

from __future__ import annotations

import numpy as np

from ..types import TriangleMesh
from .mesh import triangle_areas
from .vectors import TINY, row_dot

FLATTEST = 1e-9  # height of a triangle over its base, below which it has no shape that could be stretched
STRETCHED = 3.0  # factor beyond which a triangle counts as over-stretched: texture and shading show it by then


class RestShape:
    """What is needed of a rest shape, computed once for all frames."""

    def __init__(self, rest: TriangleMesh):
        self._triangles = rest.triangles
        u, v = _sides(rest.vertices, rest.triangles)
        length = np.maximum(np.linalg.norm(u, axis=1), TINY)
        along = row_dot(u, v) / length
        self._length, self._along = length, along
        height = np.sqrt(np.maximum(row_dot(v, v) - along**2, 0.0))
        self._height = np.maximum(height, FLATTEST * length)

    def stretches(self, vertices: np.ndarray) -> np.ndarray:
        """(S,) largest factor by which each triangle is stretched in any direction, with the vertices at (R, 3) positions."""
        return self.factors(vertices)[0]

    def factors(self, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(S,) largest and (S,) smallest factor by which each triangle is stretched in any direction.

        They are the singular values of the linear map from the triangle at rest to the triangle as it is, with the vertices at (R, 3)
        positions.
        """
        u, v = _sides(vertices, self._triangles)
        first = u / self._length[:, None]
        second = (v - self._along[:, None] * first) / self._height[:, None]
        a, b, c = row_dot(first, first), row_dot(first, second), row_dot(second, second)
        middle, radius = (a + c) / 2, np.sqrt(((a - c) / 2) ** 2 + b**2)
        return np.sqrt(middle + radius), np.sqrt(np.maximum(middle - radius, 0.0))

    def overstretched(self, vertices: np.ndarray) -> float:
        """Share of the surface, by its area as it is, whose triangles are stretched beyond STRETCHED."""
        areas = triangle_areas(TriangleMesh(vertices, self._triangles))
        return float(areas[self.stretches(vertices) > STRETCHED].sum() / max(areas.sum(), TINY))


def _sides(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    return b - a, c - a
