"""An order of triangles in which nearly each shares an edge with one of the last few, as packed index lists want it."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

EDGES, VERTICES = 15, 12  # of the latest, that the packing of triangles can name

Triangle = tuple[int, int, int]


class _Walk:
    """Triangles that are left, by their edges, and the latest edges and vertices."""

    def __init__(self, triangles: list[Triangle]):
        self._triangles, self._left = triangles, [True] * len(triangles)
        self._at_edge: dict[tuple[int, int], list[int]] = defaultdict(list)
        self._live: dict[int, int] = defaultdict(int)
        for index, (a, b, c) in enumerate(triangles):
            for edge in ((a, b), (b, c), (c, a)):
                self._at_edge[edge].append(index)
            for corner in (a, b, c):
                self._live[corner] += 1
        self._edges: list[tuple[int, int]] = []
        self._older: list[tuple[int, int]] = []
        self._vertices: list[int] = []
        self._scan = 0

    def next(self) -> Triangle:
        """The triangle at one of the latest edges that is most urgent, else at the latest edge that has one, else any."""
        options = []
        for age, edge in enumerate(reversed(self._edges)):
            for index in self._at_edge[edge]:
                if self._left[index]:
                    options.append((*self._urgency(index, edge), age, index))
        return self._taken(min(options)[-1] if options else self._elsewhere())

    def _urgency(self, index: int, edge: tuple[int, int]) -> tuple[int, bool]:
        """Low for a corner with few triangles left, which would be left alone, and for a third corner that is remembered."""
        corners = self._triangles[index]
        third = next(corner for corner in corners if corner not in edge)
        return min(self._live[corner] for corner in corners), third not in self._vertices

    def _elsewhere(self) -> int:
        while self._older:  # each round takes one out
            edge = self._older.pop()
            for index in self._at_edge[edge]:
                if self._left[index]:
                    return index
        while not self._left[self._scan]:  # called only while a triangle is left
            self._scan += 1
        return self._scan

    def _taken(self, index: int) -> Triangle:
        a, b, c = triangle = self._triangles[index]
        self._left[index] = False
        reversed_edges = [(b, a), (c, b), (a, c)]
        self._edges = (self._edges + reversed_edges)[-EDGES:]
        self._older += reversed_edges
        for corner in triangle:
            self._live[corner] -= 1
            if corner not in self._vertices:
                self._vertices = (self._vertices + [corner])[-VERTICES:]
        return triangle


def packing_order(triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3) the same triangles in another order over vertices in the order in which they appear, and the (V,) old number of each.

    triangles : (T, 3) over `count` vertices, three different ones each; vertices that no triangle has come last.
    """
    walk = _Walk([(a, b, c) for a, b, c in triangles.tolist()])
    ordered = np.array([walk.next() for _ in range(len(triangles))], dtype=np.int64).reshape(-1, 3)
    _, first = np.unique(ordered, return_index=True)
    used = ordered.ravel()[np.sort(first)]
    order = np.concatenate([used, np.setdiff1d(np.arange(count), used)])
    new = np.empty(count, dtype=np.int64)
    new[order] = np.arange(count)
    return new[ordered], order
