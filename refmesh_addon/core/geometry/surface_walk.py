"""Closest points of many points that lie close together: each starts at a neighbor's triangle and walks from there.

A point's barycentric weights in a triangle tell across which edge its projection lies. On two surfaces that are close to
each other a walk takes a step or none, where a search from nothing measures to a handful of triangles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..types import FrozenArrays, TriangleMesh
from .half_edges import HalfEdges
from .mesh import unique_points
from .vectors import TINY, row_dot

LONGEST_WALK = 24  # steps; what has not arrived then goes around in a circle about a vertex
OUTSIDE = -1e-5  # weight below which a point is across the edge: above rounding in single precision
FLAT = 1e-12  # squared sine of the angle below which a triangle has no area: walks end there


@dataclass(frozen=True)
class SurfaceWalk(FrozenArrays):
    """Built once for a surface.

    middle : (3,) scene units, that all else is measured from.  origins : (T, 3) float32, first corners.
    second, third : (T, 3) float32. The weight of a triangle's second corner at p is second . (p - origin), likewise the third.
    neighbors : (T, 3) int32, across the edge opposite to each corner; -1 on a border.
    """

    middle: np.ndarray
    origins: np.ndarray
    second: np.ndarray
    third: np.ndarray
    neighbors: np.ndarray

    @classmethod
    def of(cls, mesh: TriangleMesh) -> SurfaceWalk:
        """Coinciding vertices count as one, so that walks cross the seams of a texture."""
        middle = mesh.vertices.mean(axis=0)
        a, b, c = (mesh.vertices - middle)[mesh.triangles].transpose(1, 0, 2)
        e, f = b - a, c - a
        ee, ef, ff = (row_dot(x, y)[:, None] for x, y in ((e, e), (e, f), (f, f)))
        area = ee * ff - ef * ef
        inverse = np.where(area > FLAT * ee * ff, 1.0 / np.maximum(area, TINY), 0.0)
        second, third = (ff * e - ef * f) * inverse, (ee * f - ef * e) * inverse
        origins, second, third = (array.astype(np.float32) for array in (a, second, third))
        return cls(middle, origins, second, third, _neighbors(mesh))

    def arrived(self, points: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where walks of (N, 3) points from (N,) triangles end.

        Returns the triangle (N,), the weights (N, 2) float32 of its second and third corner, and whether (N,) the point is
        straight above or below it. Points over convex edges and beyond a boundary are not: another triangle may be closer to them.
        """
        points = (points - self.middle).astype(np.float32)
        triangles, before = start.astype(np.int32), np.full(len(points), -1, np.int32)
        shares = self._shares(points, triangles)
        walking = np.arange(len(points))
        for _ in range(LONGEST_WALK):
            second, third = shares[walking].T
            first = 1.0 - second - third
            least = np.minimum(np.minimum(first, second), third)
            side = np.where(first == least, 0, np.where(second == least, 1, 2))
            after = self.neighbors[triangles[walking], side]
            on = (least < OUTSIDE) & (after >= 0) & (after != before[walking])
            walking, after = walking[on], after[on]
            if not len(walking):
                break
            before[walking], triangles[walking] = triangles[walking], after
            shares[walking] = self._shares(points[walking], after)
        second, third = shares.T
        return triangles, shares, np.minimum(np.minimum(second, third), 1.0 - (second + third)) >= OUTSIDE

    def _shares(self, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        offset = points - self.origins[triangles]
        return np.stack([row_dot(offset, dual[triangles]) for dual in (self.second, self.third)], axis=1)


def _neighbors(mesh: TriangleMesh) -> np.ndarray:
    """(T, 3) triangle across the edge opposite to each corner, -1 on a boundary and where more than two triangles meet."""
    corners = unique_points(mesh.vertices)[1][mesh.triangles]
    one, other = HalfEdges(corners, len(mesh.vertices)).pairs.T
    across = np.full(corners.size, -1, np.int32)
    across[one], across[other] = other // 3, one // 3
    return np.roll(across.reshape(-1, 3), -1, axis=1)  # the edge opposite to a corner starts at the next one
