"""Values at the vertices of a mesh, smoothed over its edges."""

from __future__ import annotations

import numpy as np

from ..types import TriangleMesh
from .half_edges import HalfEdges


class VertexSmoother:
    """Built once from a mesh, then averages values with those of neighboring vertices, however often."""

    def __init__(self, mesh: TriangleMesh):
        self._start, self._end = HalfEdges.of(mesh).edges.T
        self._count = len(mesh.vertices)
        self._degree = np.bincount(self._start, minlength=self._count) + np.bincount(self._end, minlength=self._count)

    def step(self, values: np.ndarray) -> np.ndarray:
        """(V,) mean of each value and the mean of its neighbors'; a vertex without neighbors keeps its own."""
        around = np.bincount(self._start, values[self._end], self._count) + np.bincount(self._end, values[self._start], self._count)
        return np.where(self._degree > 0, (values + around / np.maximum(self._degree, 1)) / 2, values)

    def smoothed(self, values: np.ndarray, steps: int) -> np.ndarray:
        """(V,) values after so many steps."""
        for _ in range(steps):
            values = self.step(values)
        return values
