"""Exact closest points on a triangle mesh, vectorised over the queries.

Let b be the distance of a query q from a triangle. Only triangles whose smallest sphere, middle m and radius r, is as near can
win: |q - m| <= b + r. For a tree to list them in about that order, large and small ones, it has a fourth axis: the squared
distance to a middle lifted by sqrt(R^2 - r^2), where R is the greatest radius, is |q - m|^2 - r^2 + R^2, and then at most (b + R)^2.
Close to the surface a handful pass, and most queries are done with the first few.

Far from it many would. Let x be the closest point of a triangle. The line from q to x is square to the triangle, or to the edge that
holds x, so one corner c of the triangle (one end of that edge) has |q - c|^2 = b^2 + |x - c|^2, and |x - c| is at most the
longest edge over sqrt(3). Only triangles with a corner that near can win, and as this bound adds squares, few corners pass it
however far the query. They are lifted likewise, by sqrt(w - w_c), where w_c is the greatest such share of a triangle around c and
w that of all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..types import FrozenArrays, TriangleMesh
from .ragged import ragged_indices

FIRST = 8  # spheres fetched for every query, which settle most of them
MORE = 4  # times as many corners for the rest, and again times as many in each further round
BLOCK = 1 << 16  # spheres or corners fetched at once: what is made of them then stays in the processor's cache
COARSEST = 2.0  # longest edge of a piece, in median longest edges of the triangles
MOST_PIECES = 4  # pieces per triangle in the mean, beyond that pieces stay larger and searches slower ...
SPARE_PIECES = 1000  # ... and this many for a mesh of a few triangles
ROUNDING = 1e-13  # squared distances that differ by less than this share of the squared size are equal but for rounding
SLACK = 1e-9  # share added to the squared reach: rounding must not lose a winner

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
    """Built once from a mesh, asked often.

    Large triangles are cut into pieces for the search, so that one large triangle does not widen every reach.
    """

    def __init__(self, mesh: TriangleMesh):
        if not len(mesh.triangles):
            raise ValueError("mesh has no triangles to measure to")
        self.mesh = mesh
        self._middle = mesh.vertices.mean(axis=0)  # measured from here, far-away coordinates keep their digits
        axes = np.ascontiguousarray((mesh.vertices - self._middle).T)
        triangles, longest = _longest_first(axes, mesh.triangles.T)
        self._planes = _planes(axes, triangles)
        self._nodes, self._pieces, self._owners, self._longest = _pieces(axes, triangles, longest)
        self._spheres = _smallest_spheres(self._nodes, self._pieces)
        self._rounding = ROUNDING * float(np.abs(axes).max()) ** 2
        self._largest = float(self._spheres[3].max())
        lift = np.sqrt((self._largest - self._spheres[3]) * (self._largest + self._spheres[3]))  # rounding makes no square negative here
        self._tree = cKDTree(np.vstack([self._spheres[:3], lift]).T, balanced_tree=False)

    @cached_property
    def _corners(self) -> _Corners:
        return _Corners(self._nodes, self._pieces, self._longest)

    def query(self, points: np.ndarray, max_distance: float = np.inf, allowed: Allowed | None = None) -> ClosestPoints:
        """Closest surface point of each of (N, 3) points, on the triangles that are allowed for it.

        A triangle is only asked about where it is near enough to win; one that is refused costs as if it were not there.
        """
        points = np.asarray(points, dtype=np.float64)
        search = _Search(self, points - self._middle, float(max_distance), allowed)
        active, count = _in_blocks(search.begin, np.arange(len(points)), BLOCK // FIRST), MORE * FIRST
        while len(active):
            active = _in_blocks(partial(search.advance, count=count), active, max(1, BLOCK // count))
            if count >= self._corners.tree.n:
                break
            count *= MORE
        found = search.owners >= 0
        closest = np.where(found[:, None], search.closest + self._middle, points)
        return ClosestPoints(closest, search.owners, np.where(found, np.sqrt(search.squares), np.inf))


class _Corners:
    """The nodes of the pieces in a tree, lifted.  widest : w.  around, starts : the pieces at each node, node after node."""

    def __init__(self, nodes: np.ndarray, pieces: np.ndarray, longest: np.ndarray):
        around = sparse.csr_matrix((np.ones(pieces.size), (pieces.ravel(), np.tile(np.arange(pieces.shape[1]), 3))))
        self.around, self.starts = around.indices, around.indptr
        covers = np.maximum.reduceat(longest[self.around] ** 2 / 3.0, np.minimum(self.starts[:-1], len(self.around) - 1))
        self.widest = float(covers.max())
        self.tree = cKDTree(np.vstack([nodes[:, : len(covers)], np.sqrt(self.widest - covers)]).T, balanced_tree=False)


class _Search:
    """The best found so far for each query of one call."""

    def __init__(self, index: SurfaceIndex, points: np.ndarray, max_distance: float, allowed: Allowed | None):
        self._index, self._points, self._allowed = index, points, allowed
        self._axes = np.ascontiguousarray(points.T)
        self._greatest = max_distance
        self.squares = np.full(len(points), max_distance**2)
        self.owners = np.full(len(points), -1)
        self.closest = points.copy()

    def begin(self, queries: np.ndarray) -> np.ndarray:
        """Looks at the triangles with the nearest spheres; returns the queries for which others can win."""
        limit = (self._greatest + self._index._largest) * (1 + SLACK)
        distance, piece = self._fetched(self._index._tree, queries, FIRST, limit)
        found = np.isfinite(distance[:, 0])
        self._measure(queries[found], self._index._owners[piece[found, 0]])  # most often the winner: rules out most others
        rows, columns = np.nonzero(distance <= self._touching(queries)[:, None])
        self._improve(queries[rows], piece[rows, columns])
        return queries[distance[:, -1] <= self._touching(queries)]

    def advance(self, queries: np.ndarray, count: int) -> np.ndarray:
        """Looks at the triangles around the nearest `count` corners; returns the queries that need more.

        All of the corners, also those of the round before: of corners equally far, the two rounds may have fetched different ones.
        """
        corners = self._index._corners
        distance, corner = self._fetched(corners.tree, queries, count, np.sqrt(self._greatest**2 + corners.widest) * (1 + SLACK))
        rows, columns = np.nonzero(distance**2 <= self._reach(queries)[:, None])
        corner = corner[rows, columns]
        around = corners.starts[corner + 1] - corners.starts[corner]
        which, place = ragged_indices(around)
        self._improve(queries[rows[which]], corners.around[corners.starts[corner[which]] + place])
        return queries[distance[:, -1] ** 2 <= self._reach(queries)]

    def _fetched(self, tree: cKDTree, queries: np.ndarray, count: int, limit: float) -> tuple[np.ndarray, np.ndarray]:
        """(N, k) distances to the nearest `count` or all lifted points, and which they are; inf beyond the limit."""
        points = np.column_stack([self._points[queries], np.zeros(len(queries))])
        return tree.query(points, k=np.arange(1, min(count, tree.n) + 1), distance_upper_bound=limit)

    def _touching(self, queries: np.ndarray) -> np.ndarray:
        """Distance of the farthest lifted sphere whose triangle can win."""
        return (np.sqrt(self.squares[queries] + self._index._rounding) + self._index._largest) * (1 + SLACK)

    def _reach(self, query):
        """Squared distance of the farthest lifted corner whose triangles can win."""
        return (self.squares[query] + self._index._rounding + self._index._corners.widest) * (1 + SLACK)

    def _improve(self, query: np.ndarray, piece: np.ndarray) -> None:
        """Measures to the piece's triangle in each pair where its sphere is near enough; equal queries stand together."""
        near = (self._index._owners[piece] != self.owners[query]) & self._touched(query, piece)
        self._measure(query[near], self._index._owners[piece[near]])

    def _touched(self, query: np.ndarray, piece: np.ndarray) -> np.ndarray:
        """Whether a piece's sphere is as near as the best found."""
        x, y, z, radius = self._index._spheres.take(piece, axis=1)
        px, py, pz = self._axes.take(query, axis=1)
        reach = radius + np.sqrt(self.squares[query] + self._index._rounding)
        return (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2 <= reach**2 * (1 + SLACK)

    def _measure(self, query, triangle):
        """Measures to one triangle in each pair, where that is allowed; equal queries stand together."""
        if self._allowed is not None:
            kept = self._allowed(query, triangle)
            query, triangle = query[kept], triangle[kept]
        if not len(query):
            return
        planes = self._index._planes.take(triangle, axis=1)
        square, along, across = _closest_in_plane(self._axes.take(query, axis=1), planes)
        groups = np.flatnonzero(np.diff(query, prepend=-1))
        group = np.cumsum(np.diff(query, prepend=-1) > 0) - 1
        least = np.minimum.reduceat(square, groups)
        # Ties go to the lowest triangle, up to rounding: whatever the unit, a point nearest to an edge gets the same side of it.
        rounding = self._index._rounding
        equal = square <= least[group] + rounding
        lowest = np.minimum.reduceat(np.where(equal, triangle, len(self._index.mesh.triangles)), groups)
        best = np.flatnonzero(equal & (triangle == lowest[group]))
        best = best[np.diff(query[best], prepend=-1) > 0]
        gain, owner = self.squares[query[best]] - square[best], self.owners[query[best]]
        best = best[np.where(owner < 0, gain > 0, (gain > rounding) | ((gain >= -rounding) & (triangle[best] < owner)))]
        chosen = query[best]
        self.squares[chosen], self.owners[chosen] = square[best], triangle[best]
        self.closest[chosen] = (planes[0:3, best] + along[best] * planes[3:6, best] + across[best] * planes[6:9, best]).T


def _planes(axes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(15, T) for (3, T) triangles of (3, V) vertices, each laid flat in its own plane, longest edge from (0, 0) along x.

    Rows: start of that edge (3), its direction (3), the direction across (3), the normal (3), its length, the third corner (2).
    """
    start, end, apex = (axes.take(corner, axis=1) for corner in triangles)
    length = np.sqrt(_dot(end - start, end - start))
    along = np.where(length > 0, end - start, [[1.0], [0.0], [0.0]]) / np.where(length > 0, length, 1.0)
    offset = apex - start
    x = _dot(offset, along)
    across = offset - x * along
    flat = np.flatnonzero(_dot(across, across) <= (np.finfo(float).eps * length) ** 2)
    # any direction square to the edge serves a triangle without area
    across[:, flat] = _cross(along[:, flat], np.eye(3)[:, np.abs(along[:, flat]).argmin(axis=0)])
    across /= np.sqrt(_dot(across, across))
    across -= _dot(across, along) * along
    across /= np.sqrt(_dot(across, across))
    return np.vstack([start, along, across, _cross(along, across), length, x, _dot(offset, across)])


def _smallest_spheres(axes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(4, N) middle and radius of the smallest sphere around each of (3, N) triangles of (3, V) vertices, longest edge first."""
    corners = [axes.take(corner, axis=1) for corner in triangles]
    edge, side = corners[1] - corners[0], corners[2] - corners[0]
    long, short, shared = _dot(edge, edge), _dot(side, side), _dot(edge, side)
    area = long * short - shared**2
    acute = (short > shared) & (area > SLACK * long * short)  # at the third corner; if not, or no area, the longest edge's middle serves
    doubled = np.where(acute, 2.0 * area, 1.0)
    along = np.where(acute, short * (long - shared), 0.5) / doubled
    across = np.where(acute, long * (short - shared), 0.0) / doubled
    middle = corners[0] + along * edge + across * side
    squares = [_dot(corner - middle, corner - middle) for corner in corners]
    return np.vstack([middle, np.sqrt(np.maximum.reduce(squares))])


def _in_blocks(work: Callable[[np.ndarray], np.ndarray], items: np.ndarray, size: int) -> np.ndarray:
    parts = [work(items[at : at + size]) for at in range(0, len(items), size)]
    return np.concatenate(parts) if parts else items


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N,) of (3, N) columns: three times as fast as of rows, and so are the others here."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _closest_in_plane(points: np.ndarray, planes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Squared distance of each of (3, N) points to its triangle and the closest point's two coordinates in the plane, each (N,)."""
    offset = points - planes[0:3]
    u, v, height = (_dot(offset, planes[at : at + 3]) for at in (3, 6, 9))
    length, x, y = planes[12:15]
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


def _longest_first(axes: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(3, N) triangles of (3, V) vertices turned so that their longest edge joins the first two corners, and its (N,) length."""
    corners = [axes.take(corner, axis=1) for corner in triangles]
    squares = np.stack([_dot(end - start, end - start) for start, end in zip(corners, corners[1:] + corners[:1])])
    order = (squares.argmax(axis=0) + np.arange(3)[:, None]) % 3
    return np.take_along_axis(triangles, order, axis=0), np.sqrt(squares.max(axis=0))


def _pieces(nodes: np.ndarray, triangles: np.ndarray, longest: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Triangles cut at the middle of their longest edge until none is large, largest first.

    nodes : (3, V).  triangles, longest : as `_longest_first` gives them. Returns nodes with the middles added (3, M), the corners
    of the pieces (3, N), the triangle of each (N,) and the longest edge of each (N,). Neighbours cut at one edge have a middle each.
    """
    owners, pieces = np.arange(len(longest)), triangles
    fine, most = COARSEST * np.median(longest), MOST_PIECES * len(longest) + SPARE_PIECES
    while True:
        large = longest > max(fine, 0.7 * longest.max())
        if not large.any() or len(owners) + large.sum() > most:
            return nodes, pieces, owners, longest
        start, end, apex = pieces[:, large]
        middle = nodes.shape[1] + np.arange(len(start))
        nodes = np.hstack([nodes, (nodes[:, start] + nodes[:, end]) / 2])
        halves = np.hstack([np.stack([start, middle, apex]), np.stack([middle, end, apex])])
        halves, lengths = _longest_first(nodes, halves)
        pieces = np.hstack([pieces[:, ~large], halves])
        owners = np.concatenate([owners[~large], np.tile(owners[large], 2)])
        longest = np.concatenate([longest[~large], lengths])
