"""Values of one surface on another one: by nearest surface, and with the seams of corner values kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..types import FrozenArrays, TriangleMesh
from .borders import barycentric
from .closest_point import SurfaceIndex
from .graph import connected_components
from .half_edges import HalfEdges


@dataclass(frozen=True)
class SurfacePoints(FrozenArrays):
    """Points on a mesh.  triangles : (N,) int.  weights : (N, 3) barycentric coordinates in them."""

    triangles: np.ndarray
    weights: np.ndarray

    def interpolated(self, corner_values: np.ndarray) -> np.ndarray:
        """(N, K) values, linear in each triangle, from the (T, 3, K) values at the corners of all triangles."""
        return np.einsum("nc,nck->nk", self.weights, corner_values[self.triangles])

    def nearest(self, corner_values: np.ndarray) -> np.ndarray:
        """(N, K) values of the nearest corner, for values that have no mean: (T, 3, K) of any type."""
        return corner_values[self.triangles, self.weights.argmax(axis=1)]


class SurfaceTransfer:
    """Where the vertices, corners and triangles of `target` lie on `source`: queried once for all values of a kind.

    Both meshes are expected in the same place. Raises ValueError when the source has no triangles.
    """

    def __init__(self, source: TriangleMesh, target: TriangleMesh):
        self._source, self._target = source, target
        self._index = SurfaceIndex(source)
        self.vertices = self._located(target.vertices)
        self.triangles = self._located(target.vertices[target.triangles].mean(axis=1))

    def corners(self, corner_values: np.ndarray) -> SurfacePoints:
        """Where the 3 T corners of the target take values from that have seams, such as UV coordinates.

        corner_values : (T, 3, K) of the source. A triangle takes all of its corners from the island that is nearest to its centroid, so
        that none stretches from one island to another; what lies beyond the island is projected to its border.
        """
        island = islands(self._source, corner_values)
        allowed_island = np.repeat(island[self.triangles.triangles], 3)
        points = self._target.vertices[self._target.triangles].reshape(-1, 3)
        return self._located(points, lambda queries, triangles: island[triangles] == allowed_island[queries])

    def _located(self, points: np.ndarray, allowed=None) -> SurfacePoints:
        closest = self._index.query(points, allowed=allowed)
        corners = self._source.vertices[self._source.triangles[closest.triangles]]
        return SurfacePoints(closest.triangles, barycentric(closest.points, corners))


def islands(mesh: TriangleMesh, corner_values: np.ndarray) -> np.ndarray:
    """(T,) label of the island of each triangle: triangles that share an edge with equal (T, 3, K) values on both sides are in one."""
    table = HalfEdges.of(mesh)
    flat = corner_values.reshape(len(table.start), -1)
    following = np.roll(corner_values, -1, axis=1).reshape(flat.shape)
    forward = (table.start < table.end)[:, None]
    ends = np.hstack([np.where(forward, flat, following), np.where(forward, following, flat)])  # values at the lower vertex first
    order = np.argsort(table.edge, kind="stable")
    first, second = order[:-1], order[1:]
    joined = (table.edge[first] == table.edge[second]) & (ends[first] == ends[second]).all(axis=1)
    pairs = np.column_stack([first[joined], second[joined]]) // 3
    return connected_components(pairs, len(mesh.triangles))[1]
