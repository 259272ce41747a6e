"""Exact closest points on a triangle mesh, vectorised over the queries.

Let x be the closest point of a triangle to a query q, b their distance. The line from q to x is square to the triangle,
or to the edge that holds x, so one corner c of the triangle (one end of that edge) has |q - c|^2 = b^2 + |x - c|^2, and
|x - c| is at most the longest edge over sqrt(3). Only triangles with a corner that near can win. This bound adds squares,
so however far the query, few corners pass it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .types import TriangleMesh, _FrozenArrays

FIRST_CORNERS = 8  # corners fetched for every query; settles most of them
MORE_CORNERS = 4  # times as many in each further round for the rest
BLOCK = 1 << 17  # corners fetched at once: bounds the memory, at most some 200 MB, whatever the number of queries
COARSEST = 2.0  # longest edge of a piece, in median longest edges of the triangles
MOST_PIECES = 4  # pieces per triangle in the mean, beyond that pieces stay larger and searches slower ...
SPARE_PIECES = 1000  # ... and this many for a mesh of a few triangles
ROUNDING = 1e-13  # squared distances that differ by less than this share of the squared size are equal but for rounding
SLACK = 1e-9  # share added to the squared reach: rounding must not lose a winner

# allowed((N,) positions in the list of queries, (N,) triangles) -> (N,) bool
Allowed = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class ClosestPoints(_FrozenArrays):
    """points : (N, 3) on the surface; triangles : (N,) int64; distances : (N,) scene units.

    Queries farther than `max_distance` have distance inf, triangle -1 and their own position.
    """

    points: np.ndarray
    triangles: np.ndarray
    distances: np.ndarray


class SurfaceIndex:
    """Built once from a mesh, asked often.

    Large triangles are cut into pieces for the search, so that one large triangle does not widen every reach.
    """

    def __init__(self, mesh: TriangleMesh):
        if not len(mesh.triangles):
            raise ValueError("mesh has no triangles to measure to")
        self.mesh = mesh
        self._middle = mesh.vertices.mean(axis=0)  # measured from here, far-away coordinates keep their digits
        vertices = mesh.vertices - self._middle
        self._planes = _planes(vertices[mesh.triangles])
        nodes, pieces, owners, longest = _pieces(vertices, mesh.triangles)
        by_node = np.argsort(pieces.ravel(), kind="stable")
        self._owners = np.repeat(owners, 3)[by_node]
        self._covers = np.repeat(longest**2 / 3.0, 3)[by_node]
        self._starts = np.searchsorted(pieces.ravel()[by_node], np.arange(len(nodes) + 1))
        self._widest = float(self._covers.max())
        self._rounding = ROUNDING * float(np.abs(vertices).max()) ** 2
        self._tree = cKDTree(nodes, balanced_tree=False)

    def query(self, points: np.ndarray, max_distance: float = np.inf, allowed: Allowed | None = None) -> ClosestPoints:
        """Closest surface point of each of (N, 3) points, on the triangles that are allowed for it.

        A triangle is only asked about where it is near enough to win; one that is refused costs as if it were not there.
        """
        points = np.asarray(points, dtype=np.float64)
        search = _Search(self, points - self._middle, float(max_distance), allowed)
        active, count = np.arange(len(points)), min(FIRST_CORNERS, self._tree.n)
        while len(active):
            rows = max(1, BLOCK // count)
            active = np.concatenate([search.advance(active[at : at + rows], count) for at in range(0, len(active), rows)])
            if count == self._tree.n:
                break
            count = min(MORE_CORNERS * count, self._tree.n)
        found = search.owners >= 0
        closest = np.where(found[:, None], search.closest + self._middle, points)
        return ClosestPoints(closest, search.owners, np.where(found, np.sqrt(search.squares), np.inf))


class _Search:
    """The best found so far for each query of one call."""

    def __init__(self, index: SurfaceIndex, points: np.ndarray, max_distance: float, allowed: Allowed | None):
        self._index, self._points, self._allowed = index, points, allowed
        self._limit = np.sqrt(max_distance**2 + index._widest) * (1 + SLACK)
        self.squares = np.full(len(points), max_distance**2)
        self.owners = np.full(len(points), -1)
        self.closest = points.copy()

    def advance(self, active: np.ndarray, count: int) -> np.ndarray:
        """Looks at the nearest `count` corners of the active queries; returns those that need more.

        All of them, also those of the round before: of corners equally far, the two rounds may have fetched different ones.
        """
        distance, corner = self._index._tree.query(
            self._points[active], k=np.arange(1, count + 1), distance_upper_bound=self._limit, workers=-1
        )
        square = distance**2
        self._improve(active, square[:, :1], corner[:, :1])  # the nearest corner's triangles rule out most of the others
        self._improve(active, square[:, 1:], corner[:, 1:])
        return active[square[:, -1] <= self._reach(active, self._index._widest)]

    def _reach(self, query, cover):
        return (self.squares[query] + cover) * (1 + SLACK)

    def _improve(self, active, square, corner):
        """Measures to the triangles around (N, k) corners at the given squared distances."""
        index = self._index
        rows, columns = np.nonzero(square <= self._reach(active, index._widest)[:, None])
        corner, square = corner[rows, columns], square[rows, columns]
        around = index._starts[corner + 1] - index._starts[corner]
        slot = np.repeat(index._starts[corner] - np.cumsum(around) + around, around) + np.arange(around.sum())
        query = np.repeat(active[rows], around)
        near = np.repeat(square, around) <= self._reach(query, index._covers[slot])
        query, triangle = query[near], index._owners[slot[near]]
        if self._allowed is not None:
            kept = self._allowed(query, triangle)
            query, triangle = query[kept], triangle[kept]
        if len(query):
            self._measure(query, triangle)

    def _measure(self, query, triangle):
        planes = self._index._planes[triangle]
        square, along, across = _closest_in_plane(self._points[query], planes)
        groups = np.flatnonzero(np.diff(query, prepend=-1))
        group = np.cumsum(np.diff(query, prepend=-1) > 0) - 1
        least = np.minimum.reduceat(square, groups)
        # Ties go to the lowest triangle, up to rounding: whatever the unit, a point nearest to an edge gets the same side of it.
        rounding = self._index._rounding
        equal = square <= least[group] + rounding
        lowest = np.minimum.reduceat(np.where(equal, triangle, len(self._index._planes)), groups)
        best = np.flatnonzero(equal & (triangle == lowest[group]))
        best = best[np.diff(query[best], prepend=-1) > 0]
        gain, owner = self.squares[query[best]] - square[best], self.owners[query[best]]
        best = best[np.where(owner < 0, gain > 0, (gain > rounding) | ((gain >= -rounding) & (triangle[best] < owner)))]
        chosen = query[best]
        self.squares[chosen], self.owners[chosen] = square[best], triangle[best]
        self.closest[chosen] = planes[best, 0:3] + along[best, None] * planes[best, 3:6] + across[best, None] * planes[best, 6:9]


def _planes(corners: np.ndarray) -> np.ndarray:
    """(T, 15) for (T, 3, 3) triangles, each laid flat in its own plane, longest edge from (0, 0) along x.

    Columns: start of that edge (3), its direction (3), the direction across (3), the normal (3), its length, the third corner (2).
    """
    start, end, apex = _longest_first(corners)[0].transpose(1, 0, 2)
    length = np.linalg.norm(end - start, axis=1)
    along = _unit(end - start, np.array([1.0, 0.0, 0.0]))
    offset = apex - start
    x = np.einsum("ij,ij->i", offset, along)
    # any direction square to the edge serves a triangle without area
    spare = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    across = offset - x[:, None] * along
    across = _unit(np.where(np.linalg.norm(across, axis=1)[:, None] > np.finfo(float).eps * length[:, None], across, spare), spare)
    across = _unit(across - np.einsum("ij,ij->i", across, along)[:, None] * along, spare)
    y = np.einsum("ij,ij->i", offset, across)
    return np.column_stack([start, along, across, np.cross(along, across), length, x, y])


def _unit(vectors: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1.0), otherwise)


def _closest_in_plane(points: np.ndarray, planes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Squared distance of each of (N, 3) points to its triangle and the closest point's two coordinates in the plane, each (N,)."""
    offset = points - planes[:, 0:3]
    u, v, height = (np.einsum("ij,ij->i", offset, planes[:, at : at + 3]) for at in (3, 6, 9))
    length, x, y = planes[:, 12:15].T
    zero = np.zeros_like(u)
    along, across = np.clip(u, 0.0, length), zero
    square = (u - along) ** 2 + v**2
    inside = v >= 0
    for start, sign in ((zero, 1.0), (length, -1.0)):
        run = x - start
        share = np.clip(((u - start) * run + v * y) / np.maximum(run**2 + y**2, np.finfo(float).tiny), 0.0, 1.0)
        nearer = (u - start - share * run) ** 2 + (v - share * y) ** 2 < square
        along, across = np.where(nearer, start + share * run, along), np.where(nearer, share * y, across)
        square = np.where(nearer, (u - along) ** 2 + (v - across) ** 2, square)
        inside &= sign * ((u - start) * y - v * run) >= 0
    inside &= y > 0
    return np.where(inside, 0.0, square) + height**2, np.where(inside, u, along), np.where(inside, v, across)


def _longest_first(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3, 3) triangles turned so that their longest edge joins corners 0 and 1, and its (N,) length."""
    turned, longest = _turned(corners)
    return np.take_along_axis(corners, turned[:, :, None], axis=1), longest


def _turned(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The order (N, 3) of corners in which the longest edge joins the first two, and its (N,) length."""
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    return (lengths.argmax(axis=1)[:, None] + np.arange(3)) % 3, lengths.max(axis=1)


def _pieces(nodes: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Triangles cut at the middle of their longest edge until none is large, largest first.

    nodes : (V, 3).  triangles : (T, 3).  Returns nodes with the middles added (M, 3), the corners of the pieces (N, 3), the
    triangle of each (N,) and the longest edge of each (N,). Neighbours cut at one edge have a middle each.
    """
    owners, pieces = np.arange(len(triangles)), triangles.astype(np.int64)
    turned, longest = _turned(nodes[pieces])
    pieces = np.take_along_axis(pieces, turned, axis=1)
    fine, most = COARSEST * np.median(longest), MOST_PIECES * len(triangles) + SPARE_PIECES
    while True:
        large = longest > max(fine, 0.7 * longest.max())
        if not large.any() or len(pieces) + large.sum() > most:
            return nodes, pieces, owners, longest
        start, end, apex = pieces[large].T
        middle = len(nodes) + np.arange(len(start))
        nodes = np.concatenate([nodes, (nodes[start] + nodes[end]) / 2])
        halves = np.concatenate([np.stack([start, middle, apex], axis=1), np.stack([middle, end, apex], axis=1)])
        turned, lengths = _turned(nodes[halves])
        pieces = np.concatenate([pieces[~large], np.take_along_axis(halves, turned, axis=1)])
        owners = np.concatenate([owners[~large], np.tile(owners[large], 2)])
        longest = np.concatenate([longest[~large], lengths])
