"""What the readers of mesh files share: the mesh as parsed, and triangles of polygons and of strips."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class ParsedMesh(NamedTuple):
    """vertices : (V, 3) float64.  triangles : (T, 3) integers.  omitted : faces with fewer than three corners, which are left out."""

    vertices: np.ndarray
    triangles: np.ndarray
    omitted: int = 0


def fan(corners: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Triangles (T, 3) of polygons given by their corners one after the other and the number of corners of each.

    Polygons of fewer than three corners have none.
    """
    starts = np.cumsum(sizes) - sizes
    per_polygon = np.maximum(sizes - 2, 0)
    first = np.repeat(starts, per_polygon)
    step = np.arange(per_polygon.sum()) - np.repeat(np.cumsum(per_polygon) - per_polygon, per_polygon)
    return corners[np.column_stack([first, first + step + 1, first + step + 2])]


def strip_triangles(corners: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Triangles (T, 3) of strips given as polygons are in `fan`; -1 in a strip begins another one.

    Every second triangle of a strip is turned, so that all face the same way; those with a repeated corner join strips and are left out.
    """
    place = np.arange(len(corners)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    breaks = corners < 0
    # Place within the part of the strip since the last break.
    latest = np.maximum.accumulate(np.where(breaks | (place == 0), np.arange(len(corners)) + breaks, 0)) if len(corners) else place
    place = np.arange(len(corners)) - latest
    last = np.flatnonzero((place >= 2) & ~breaks)
    triangles = np.column_stack([corners[last - 2], corners[last - 1], corners[last]])
    odd = place[last] % 2 == 1
    triangles[odd] = triangles[odd][:, [1, 0, 2]]
    distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return triangles[distinct]
