"""Points of a group's frames in the free space of its anchor frame, where most frames show nothing either.

Where parts touch, a center may own a little of both. When they part, it takes that along, and frames in which they touch then have
points in the reference positions where there is nothing: horns and ridges beside the contact. The anchor frame shows the surface there as
it is. Only what most frames show beyond it counts: a finger that the anchor frame has lost is no error of theirs.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.borders import border_edges, on_border
from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import triangle_normals
from ..geometry.vectors import row_dot
from ..types import TriangleMesh

# In s, heights above the anchor frame's surface that are free space. Aligned frames agree within 0.2 nearly everywhere; farther away there
# may be bodies that the anchor frame lacks.
LEAST, MOST = 0.3, 2.0
STRAIGHT = 0.7  # least cosine between offset and normal for what lies above a surface, and not beside it
MAJORITY = 0.5  # share of the frames that must show surface in the free space for it to count


class FreeSpace:
    """Built once from an anchor frame in reference positions."""

    def __init__(self, surface: TriangleMesh, samples: cKDTree, spacing: float):
        """surface : of the anchor frame, without what spans tears.  samples : points on it.  spacing : s, scene units."""
        self._surface, self._samples, self._spacing = surface, samples, spacing

    def holds(self, points: np.ndarray) -> np.ndarray:
        """(P,) bool, whether each of (P, 3) points lies above the surface, and not at a rim of it, which a tear may have left."""
        result = np.zeros(len(points), dtype=bool)
        # The closest point is no farther than the closest sample, which is quicker to find.
        far = np.flatnonzero(self._samples.query(points, workers=-1)[0] > LEAST * self._spacing)
        if not len(far):
            return result
        index, border, normals = self._exact
        closest = index.query(points[far], MOST * self._spacing)
        heights = row_dot(points[far] - closest.points, normals[closest.triangles])
        above = (closest.triangles >= 0) & (closest.distances > LEAST * self._spacing) & (heights > STRAIGHT * closest.distances)
        near = np.flatnonzero(above)
        result[far[near]] = ~on_border(self._surface, border, closest.triangles[near], closest.points[near])
        return result

    @cached_property
    def _exact(self) -> tuple[SurfaceIndex, np.ndarray, np.ndarray]:
        return SurfaceIndex(self._surface), border_edges(self._surface), triangle_normals(self._surface)


def in_most_frames(points: Sequence[np.ndarray], spacing: float) -> list[np.ndarray]:
    """For the (P, 3) points of each frame in free space, (P,) bool whether most frames have some there.  spacing : s, scene units."""
    trees = [cKDTree(own) for own in points if len(own)]
    return [_showing(own, trees, LEAST * spacing) > MAJORITY * len(points) for own in points]


def _showing(points: np.ndarray, trees: list[cKDTree], reach: float) -> np.ndarray:
    """(P,) how many of the frames have a point within reach of each of (P, 3) points."""
    result = np.zeros(len(points), dtype=np.int64)
    for tree in trees if len(points) else []:
        result += np.isfinite(tree.query(points, distance_upper_bound=reach)[0])
    return result
