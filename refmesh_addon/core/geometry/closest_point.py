"""Exact closest points on a triangle mesh, vectorized over the queries.

Let b be the distance from a query q to some triangle. Only triangles whose smallest enclosing sphere, with center m and radius r, comes
as close can be closer: |q - m| <= b + r. To let a k-d tree list large and small spheres in roughly that order, each center gets a fourth
coordinate, sqrt(R^2 - r^2) with R the largest radius. The squared distance from q to such a lifted center is |q - m|^2 - r^2 + R^2, which
is at most (b + R)^2 for every triangle that can be closer. Near the surface only a handful are, and most queries end with the first few.

Far from the surface, many spheres would pass this test. Let x be the closest point of a triangle. The line from q to x is perpendicular
to the triangle, or to the edge that holds x, so one corner c of the triangle (one end of that edge) has |q - c|^2 = b^2 + |x - c|^2, and
|x - c| is at most the longest edge over sqrt(3). Only triangles with a corner that close can be closer than b. The bound adds squares
rather than lengths, so few corners meet it however far the query is. Corners are lifted likewise, by sqrt(w - w_c), where w_c is the
largest |x - c|^2 over the triangles at c, and w the largest of all w_c.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.spatial import cKDTree

from ..types import FrozenArrays, TriangleMesh
from .ragged import ragged_indices, sorted_by_label
from .triangle_pieces import Pieces, bisected, longest_edge_first, smallest_spheres
from .triangle_planes import closest_in_planes, triangle_planes

FIRST = 8  # spheres fetched for every query, which settle most of them
MORE = 4  # times as many corners for the remaining queries, and again in each further round
BLOCK = 1 << 16  # spheres or corners fetched at once: their temporary arrays then stay in the processor's cache
ROUNDING = 1e-13  # squared distances that differ by less than this share of the squared size are equal up to rounding
SLACK = 1e-9  # share added to bounds, so that rounding does not lose the closest triangle

# allowed((N,) positions in the list of queries, (N,) triangles) -> (N,) bool
Allowed = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class ClosestPoints(FrozenArrays):
    """points : (N, 3) on the surface; triangles : (N,) int64; distances : (N,) scene units.

    Queries farther than `max_distance` have distance inf, triangle -1 and their own position.
    """

    points: np.ndarray
    triangles: np.ndarray
    distances: np.ndarray


class SurfaceIndex:
    """Closest-point queries on one mesh: built once, queried often. Raises ValueError for a mesh without triangles.

    Large triangles are searched in pieces, so that a single one does not widen the search around every query.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> SurfaceIndex(square).query([[0.75, 0.25, 2.0]]).distances.round(9).tolist()
    [2.0]
    """

    def __init__(self, mesh: TriangleMesh):
        if not len(mesh.triangles):
            raise ValueError("mesh has no triangles to measure to")
        self.mesh = mesh
        self._origin = mesh.vertices.mean(axis=0)  # measured from here, coordinates far from zero keep their digits
        axes = np.ascontiguousarray((mesh.vertices - self._origin).T)
        triangles, longest = longest_edge_first(axes, mesh.triangles.T)
        self.planes = triangle_planes(axes, triangles)
        self.pieces = bisected(axes, triangles, longest)
        self.spheres = smallest_spheres(self.pieces.nodes, self.pieces.corners)
        self.rounding = ROUNDING * float(np.abs(axes).max()) ** 2
        radii = self.spheres[3]
        self.largest_radius = float(radii.max())
        lift = np.sqrt((self.largest_radius - radii) * (self.largest_radius + radii))  # as a product, never negative by rounding
        self.sphere_tree = cKDTree(np.vstack([self.spheres[:3], lift]).T, balanced_tree=False)

    @cached_property
    def corner_index(self) -> _CornerIndex:
        """The corners of the pieces in a tree, which only distant queries need."""
        return _CornerIndex(self.pieces)

    def query(self, points: np.ndarray, max_distance: float = np.inf, allowed: Allowed | None = None) -> ClosestPoints:
        """Closest surface point of each of (N, 3) points, scene units, among the triangles allowed for it.

        allowed : called only for triangles near enough to be the closest; without it all are. A triangle that is refused is searched
        past as if it did not exist.
        """
        points = np.asarray(points, dtype=np.float64)
        search = _Search(self, points - self._origin, float(max_distance), allowed)
        active, count = _in_blocks(search.try_spheres, np.arange(len(points)), BLOCK // FIRST), MORE * FIRST
        while len(active):  # ends: the count grows until it is that of all corners
            active = _in_blocks(partial(search.try_corners, count=count), active, max(1, BLOCK // count))
            if count >= self.corner_index.tree.n:
                break
            count *= MORE
        reached = search.owners >= 0
        closest = np.where(reached[:, None], search.closest + self._origin, points)
        return ClosestPoints(closest, search.owners, np.where(reached, np.sqrt(search.squares), np.inf))


class _CornerIndex:
    """Lifted corners of pieces in a tree.

    widest : w, scene units squared.  around : the pieces at each node, node after node.  starts : where in it each node begins.
    """

    def __init__(self, pieces: Pieces):
        order, self.starts = sorted_by_label(pieces.corners.T.ravel(), pieces.nodes.shape[1])
        self.around = order // 3
        # Nodes without pieces get an arbitrary value, as reduceat needs a valid index for them too.
        largest = np.maximum.reduceat(pieces.longest[self.around] ** 2 / 3.0, np.minimum(self.starts[:-1], len(order) - 1))
        self.widest = float(largest.max())
        self.tree = cKDTree(np.vstack([pieces.nodes, np.sqrt(self.widest - largest)]).T, balanced_tree=False)


class _Search:
    """The closest point so far for each query of one call.

    squares : (N,) squared distances.  owners : (N,) triangles, -1 for none.  closest : (N, 3) points, from the origin of the index.
    """

    def __init__(self, index: SurfaceIndex, points: np.ndarray, max_distance: float, allowed: Allowed | None):
        self._index, self._points, self._allowed, self._max_distance = index, points, allowed, max_distance
        self._axes = np.ascontiguousarray(points.T)
        self.squares = np.full(len(points), max_distance**2)
        self.owners = np.full(len(points), -1)
        self.closest = points.copy()

    def try_spheres(self, queries: np.ndarray) -> np.ndarray:
        """Measures to the triangles with the nearest spheres; returns the queries for which others can be closer."""
        limit = (self._max_distance + self._index.largest_radius) * (1 + SLACK)
        distance, piece = self._nearest(self._index.sphere_tree, queries, FIRST, limit)
        reached = np.isfinite(distance[:, 0])
        self._measure(queries[reached], self._index.pieces.owners[piece[reached, 0]])  # usually the closest: rules out most others
        rows, columns = np.nonzero(distance <= self._sphere_bound(queries)[:, None])
        self._measure_where_near(queries[rows], piece[rows, columns])
        return queries[distance[:, -1] <= self._sphere_bound(queries)]

    def try_corners(self, queries: np.ndarray, count: int) -> np.ndarray:
        """Measures to the triangles around the nearest `count` corners; returns the queries that need more.

        The corners of the previous round are fetched again: among equally distant ones, the two rounds may choose differently.
        """
        corners = self._index.corner_index
        distance, corner = self._nearest(corners.tree, queries, count, np.sqrt(self._max_distance**2 + corners.widest) * (1 + SLACK))
        rows, columns = np.nonzero(distance**2 <= self._squared_corner_bound(queries)[:, None])
        corner = corner[rows, columns]
        row, column = ragged_indices(corners.starts[corner + 1] - corners.starts[corner])
        self._measure_where_near(queries[rows[row]], corners.around[corners.starts[corner[row]] + column])
        return queries[distance[:, -1] ** 2 <= self._squared_corner_bound(queries)]

    def _nearest(self, tree: cKDTree, queries: np.ndarray, count: int, limit: float) -> tuple[np.ndarray, np.ndarray]:
        """(N, k) distances to the nearest lifted points, at most `count`, and their indices; inf beyond the limit."""
        points = np.column_stack([self._points[queries], np.zeros(len(queries))])
        return tree.query(points, k=np.arange(1, min(count, tree.n) + 1), distance_upper_bound=limit)

    def _sphere_bound(self, queries: np.ndarray) -> np.ndarray:
        """Distance of the farthest lifted center whose triangle can be closer."""
        return (np.sqrt(self.squares[queries] + self._index.rounding) + self._index.largest_radius) * (1 + SLACK)

    def _squared_corner_bound(self, queries: np.ndarray) -> np.ndarray:
        """Squared distance of the farthest lifted corner whose triangles can be closer."""
        return (self.squares[queries] + self._index.rounding + self._index.corner_index.widest) * (1 + SLACK)

    def _measure_where_near(self, queries: np.ndarray, pieces: np.ndarray) -> None:
        """Measures each query to its piece's triangle where that can be closer; equal queries must be adjacent."""
        owners = self._index.pieces.owners[pieces]
        near = (owners != self.owners[queries]) & self._sphere_is_near(queries, pieces)
        self._measure(queries[near], owners[near])

    def _sphere_is_near(self, queries: np.ndarray, pieces: np.ndarray) -> np.ndarray:
        x, y, z, radius = self._index.spheres.take(pieces, axis=1)
        px, py, pz = self._axes.take(queries, axis=1)
        reach = radius + np.sqrt(self.squares[queries] + self._index.rounding)
        return (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2 <= reach**2 * (1 + SLACK)

    def _measure(self, queries: np.ndarray, triangles: np.ndarray) -> None:
        """Measures each query to one triangle, where that is allowed, and keeps the closest; equal queries must be adjacent."""
        if self._allowed is not None:
            kept = self._allowed(queries, triangles)
            queries, triangles = queries[kept], triangles[kept]
        if not len(queries):
            return
        planes = self._index.planes.take(triangles, axis=1)
        square, along, across = closest_in_planes(self._axes.take(queries, axis=1), planes)
        best = self._closest_of_each(queries, triangles, square)
        best = best[self._improves(queries[best], triangles[best], square[best])]
        improved = queries[best]
        self.squares[improved], self.owners[improved] = square[best], triangles[best]
        self.closest[improved] = (planes[0:3, best] + along[best] * planes[3:6, best] + across[best] * planes[6:9, best]).T

    def _closest_of_each(self, queries: np.ndarray, triangles: np.ndarray, square: np.ndarray) -> np.ndarray:
        """The measurement that counts for each query: the closest, the lowest triangle where several are equal up to rounding.

        In whatever unit, a point nearest to an edge is thus given the same side of it.
        """
        new = np.diff(queries, prepend=-1) != 0
        starts, group = np.flatnonzero(new), np.cumsum(new) - 1
        equal = square <= np.minimum.reduceat(square, starts)[group] + self._index.rounding
        lowest = np.minimum.reduceat(np.where(equal, triangles, len(self._index.mesh.triangles)), starts)
        best = np.flatnonzero(equal & (triangles == lowest[group]))
        return best[np.diff(queries[best], prepend=-1) > 0]

    def _improves(self, queries: np.ndarray, triangles: np.ndarray, square: np.ndarray) -> np.ndarray:
        """Whether a measurement takes the place of what each query has; ties as in `_closest_of_each`."""
        gain, owner, rounding = self.squares[queries] - square, self.owners[queries], self._index.rounding
        return np.where(owner < 0, gain > 0, (gain > rounding) | ((gain >= -rounding) & (triangles < owner)))


def _in_blocks(work: Callable[[np.ndarray], np.ndarray], items: np.ndarray, size: int) -> np.ndarray:
    parts = [work(items[at : at + size]) for at in range(0, len(items), size)]
    return np.concatenate(parts) if parts else items
