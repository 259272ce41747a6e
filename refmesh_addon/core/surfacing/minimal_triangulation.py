"""The triangulation of a closed polygon in space that has the least area, without slivers.

Barequet & Sharir, "Filling gaps in the boundary of a polyhedron", CAGD 1995: the best triangulation of corners i to k joins the best of
i to j and of j to k by the triangle i, j, k. Here for all i at once.
"""

from __future__ import annotations

import numpy as np

from ..geometry.vectors import TINY

# Weight against the area of the squared sides over the quality of a triangle. It decides between the many triangulations of a flat
# polygon: three corners in line cost as much as large triangles, though they have no area.
SLIVERS, WORST = 1e-4, 1e-4  # and the least quality that is distinguished from 0


def minimal_triangulation(corners: np.ndarray, barred: np.ndarray | None = None) -> np.ndarray | None:
    """(N - 2, 3) triangles of a polygon with (N, 3) corners, each in the order of the corners.

    barred : (N, N) bool, symmetric, pairs of corners that must not become a diagonal, such as those that the surface around a hole
    joins already; sides of the polygon may be among them. None where no triangulation avoids them.
    Raises ValueError for fewer than three corners.

    >>> minimal_triangulation(np.array([[0.0, 0, 0], [1, 0, 0], [0.2, 0.2, 0], [0, 1, 0]])).tolist()
    [[0, 2, 3], [0, 1, 2]]
    """
    count = len(corners)
    if count < 3:
        raise ValueError(f"a polygon needs three corners; got {count}")
    refused = np.zeros((count, count), dtype=bool) if barred is None else barred.copy()
    refused[0, -1] = False  # a side
    least, middle = np.zeros((count, count)), np.zeros((count, count), dtype=np.int64)
    for gap in range(2, count):
        first = np.arange(count - gap)[:, None]
        between, last = first + np.arange(1, gap), first + gap
        cost = least[first, between] + least[between, last] + _costs(corners[first], corners[between], corners[last])
        best = cost.argmin(axis=1)
        least[first[:, 0], last[:, 0]] = np.where(refused[first[:, 0], last[:, 0]], np.inf, cost[first[:, 0], best])
        middle[first[:, 0], last[:, 0]] = between[first[:, 0], best]
    if not np.isfinite(least[0, -1]):
        return None
    triangles, open_spans = [], [(0, count - 1)]
    while open_spans:  # each span is split into shorter ones
        start, end = open_spans.pop()
        if end - start > 1:
            split = int(middle[start, end])
            triangles.append((start, split, end))
            open_spans += [(split, end), (start, split)]
    return np.array(triangles)


def _costs(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Of triangles with corners that broadcast."""
    u, v = b - a, c - a
    squares = (u**2).sum(axis=-1) + (v**2).sum(axis=-1) + ((v - u) ** 2).sum(axis=-1)
    areas = 0.5 * np.linalg.norm(np.cross(u, v), axis=-1)
    quality = 4 * np.sqrt(3) * areas / np.maximum(squares, TINY)
    return areas + SLIVERS * squares / np.maximum(quality, WORST)
