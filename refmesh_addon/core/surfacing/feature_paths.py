"""Feature lines as edges of a mesh: along each, a path of edges is moved onto the line, so that no triangle spans it.

A reconstruction has the right surface beside a sharp edge, but its triangles do not know of the edge: some span it, and it comes out as a
saw. Here the shortest path of edges along each line is laid onto it, corners first, and the vertices beside it are spread evenly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..geometry.borders import border_edges, on_border
from ..geometry.closest_point import SurfaceIndex
from ..geometry.cotangent import neighbor_averages, triangle_adjacency
from ..geometry.feature_lines import ordered_lines
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import edge_lengths, mean_edge_length
from ..geometry.rings import grown
from ..geometry.self_intersection import crossing_triangles
from ..types import FrozenArrays, TriangleMesh
from .edge_flips import flipped

REACH = 1.5  # mean edge lengths from a line within which its path runs
DETOUR = 4.0  # cost of an edge a mean edge length off the line, against one on it
SAMPLES = 4  # points on a line per mean edge length, to measure distances from it
CANDIDATES = 16  # vertices among which that of a corner is chosen
LOOP_PARTS = 3  # into which a closed line is divided, so that each has two ends
RINGS, SMOOTHINGS = 2, 12  # rings of vertices beside a line that are spread evenly, and how often
FLIPS = 3  # passes of edge flips at the end
MOST_REPAIRS = 6  # rounds in which vertices of crossing triangles go back, and their neighbors; one or two are enough


@dataclass(frozen=True)
class FeatureMesh(FrozenArrays):
    """A mesh.  features : (K, 2) int32, those of its edges that lie on feature lines.  crossing : triangles that cross another one."""

    mesh: TriangleMesh
    features: Annotated[np.ndarray, "(K, 2) int32"]
    crossing: int


def with_feature_edges(mesh: TriangleMesh, beside: TriangleMesh, edges: np.ndarray) -> FeatureMesh:
    """The mesh with edges along feature lines, as many vertices and triangles.

    beside : the surface that has the lines.  edges : (E, 2) edges of it, the lines. A line to which no path leads is left out, and
    lines stop short of where the mesh would come to cross itself, as it does where they run closer together than its edges are long.
    """
    lines = [part for line in sorted(ordered_lines(beside.vertices, edges), key=len, reverse=True) for part in _parts(line)]
    paths = _Paths(mesh, beside.vertices, np.unique(np.array([line[[0, -1]] for line in lines], dtype=np.int64)))
    for line in lines:
        paths.lay(line)
    kept = np.zeros(len(mesh.vertices), dtype=bool)
    for _ in range(MOST_REPAIRS if paths.features else 0):
        laid, features = _laid(mesh, paths, kept, beside)
        crossing = crossing_triangles(laid)
        back = _moved(mesh, laid, crossing, kept)
        if not back.any():
            return FeatureMesh(laid, features, int(crossing.sum()))
        kept |= back
    return FeatureMesh(mesh, np.zeros((0, 2), dtype=np.int32), int(crossing_triangles(mesh).sum()))


def _laid(mesh: TriangleMesh, paths: _Paths, kept: np.ndarray, beside: TriangleMesh) -> tuple[TriangleMesh, np.ndarray]:
    """The mesh with paths on their lines, but (V,) bool `kept` vertices where they were; and the edges that lie on lines."""
    on_line = paths.taken & ~kept
    laid = mesh.moved(np.where(on_line[:, None], paths.positions, mesh.vertices))
    features = np.unique(np.sort(np.concatenate(paths.features), axis=1), axis=0).astype(np.int32)
    features = features[on_line[features].all(axis=1)]
    return _flipped(_smoothed_beside(laid, on_line, kept, beside), features), features


def _moved(mesh: TriangleMesh, laid: TriangleMesh, crossing: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """(V,) bool, the vertices of crossing triangles and of those around `kept` ones of them that are not where they were."""
    corners = np.zeros(len(kept), dtype=bool)
    corners[laid.triangles[crossing]] = True
    stuck = corners & kept
    corners[mesh.triangles[stuck[mesh.triangles].any(axis=1)]] = True
    return corners & (laid.vertices != mesh.vertices).any(axis=1)


def _parts(line: np.ndarray) -> list[np.ndarray]:
    """The line, or the parts of a closed one."""
    if line[0] != line[-1]:
        return [line]
    cuts = np.linspace(0, len(line) - 1, LOOP_PARTS + 1).round().astype(int)
    return [line[start : end + 1] for start, end in zip(cuts[:-1], cuts[1:], strict=True)]


class _Paths:
    """The paths laid so far along lines through points.

    points : (N, 3).  corners : (C,) those of them at which lines end.
    positions : (V, 3) of the vertices.  taken : (V,) bool, vertices on a path.  features : of each path, its (K, 2) edges.
    """

    def __init__(self, mesh: TriangleMesh, points: np.ndarray, corners: np.ndarray):
        self._mesh, self._points, self._edges = mesh, points, HalfEdges.of(mesh).edges.astype(np.int64)
        self._lengths = edge_lengths(mesh.vertices, self._edges)
        self._length = float(self._lengths.mean())
        self._tree = cKDTree(mesh.vertices)
        self.positions, self.taken = mesh.vertices.copy(), np.zeros(len(mesh.vertices), dtype=bool)
        self._ends = self._vertices_of(corners)
        self._reserved = np.zeros(len(mesh.vertices), dtype=bool)  # else a path that passes by would take the corner of another
        self._reserved[list(self._ends.values())] = True
        self.features: list[np.ndarray] = []

    def _vertices_of(self, corners: np.ndarray) -> dict[int, int]:
        """A vertex for each corner, within reach and no other's: the nearest pairs first."""
        count = np.arange(1, min(CANDIDATES, self._tree.n) + 1)
        distances, near = self._tree.query(self._points[corners], k=count, distance_upper_bound=REACH * self._length)
        order = np.argsort(distances, axis=None, kind="stable")[: np.isfinite(distances).sum()]
        corner_of: dict[int, int] = {}
        result: dict[int, int] = {}
        for corner, vertex in zip(np.repeat(corners, near.shape[1])[order].tolist(), near.ravel()[order].tolist(), strict=True):
            if corner not in result and vertex not in corner_of:
                result[corner], corner_of[vertex] = vertex, corner
        return result

    def lay(self, line: np.ndarray) -> None:
        """Lays a path along a line, given as indices of points in order."""
        if line[0] not in self._ends or line[-1] not in self._ends:
            return
        polyline = _Polyline(self._points[line])
        path = self._path(self._ends[line[0]], self._ends[line[-1]], polyline)
        if path is not None:
            self.positions[path] = polyline.spread(self._mesh.vertices[path])
            self.taken[path] = True
            self.features.append(np.column_stack([path[:-1], path[1:]]))

    def _path(self, start: int, end: int, line: _Polyline) -> np.ndarray | None:
        """The vertices of the shortest path near a line, whose edges cost more the farther they are from it."""
        usable = np.zeros(len(self.taken), dtype=bool)
        for near in self._tree.query_ball_point(line.samples(self._length / SAMPLES), REACH * self._length):
            usable[near] = True
        usable &= ~(self.taken | self._reserved)
        usable[[start, end]] = True
        number = np.cumsum(usable) - 1
        chosen = usable[self._edges].all(axis=1)
        first, second = self._edges[chosen].T
        middle = (self._mesh.vertices[first] + self._mesh.vertices[second]) / 2
        off = line.distances(middle, self._length / SAMPLES) / self._length
        costs = self._lengths[chosen] * (1 + DETOUR * off**2)
        graph = sparse.csr_matrix((costs, (number[first], number[second])), shape=(usable.sum(), usable.sum()))
        distances, before = dijkstra(graph, directed=False, indices=number[start], return_predecessors=True)
        if not np.isfinite(distances[number[end]]):
            return None
        path = [int(number[end])]
        while path[-1] != number[start]:
            path.append(int(before[path[-1]]))
        return np.flatnonzero(usable)[_without_shortcuts(path[::-1], graph)]


def _without_shortcuts(path: list[int], graph: sparse.csr_matrix) -> list[int]:
    """The path without vertices whose neighbors on it are joined: on a straight line the three would be a triangle without area."""
    result = path[:1]
    for vertex in path[1:]:
        while len(result) > 1 and (graph[result[-2], vertex] or graph[vertex, result[-2]]):
            result.pop()
        result.append(vertex)
    return result


class _Polyline:
    """A line through (N, 3) points."""

    def __init__(self, points: np.ndarray):
        self._points = points
        self._along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])

    def at(self, along: np.ndarray) -> np.ndarray:
        """(K, 3) points at (K,) lengths from its start."""
        return np.column_stack([np.interp(along, self._along, axis) for axis in self._points.T])

    def samples(self, step: float) -> np.ndarray:
        """Points at most this far apart."""
        return self.at(np.linspace(0, self._along[-1], int(np.ceil(self._along[-1] / step)) + 1))

    def distances(self, points: np.ndarray, step: float) -> np.ndarray:
        """(K,) distance of (K, 3) points from its samples."""
        return cKDTree(self.samples(step)).query(points)[0]

    def spread(self, path: np.ndarray) -> np.ndarray:
        """(K, 3) vertices of a path moved onto the line, its first and last to the ends, as evenly as the path runs."""
        lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
        return self.at(lengths / lengths[-1] * self._along[-1])


def _smoothed_beside(mesh: TriangleMesh, fixed: np.ndarray, kept: np.ndarray, surface: TriangleMesh) -> TriangleMesh:
    """The mesh with the vertices beside (V,) bool fixed ones, except kept ones, spread evenly and laid onto the surface with the lines."""
    index, border, length = SurfaceIndex(surface), border_edges(surface), mean_edge_length(mesh)
    adjacency = triangle_adjacency(mesh)
    free = grown(adjacency, fixed, RINGS) & ~(fixed | kept)
    chosen = np.flatnonzero(free)
    for _ in range(SMOOTHINGS):
        moved = mesh.vertices.copy()
        even = neighbor_averages(adjacency, mesh.vertices)[chosen]
        nearest = index.query(even, length)
        inner = (nearest.triangles >= 0) & ~on_border(surface, border, nearest.triangles, nearest.points)
        moved[chosen] = np.where(inner[:, None], nearest.points, even)
        mesh = mesh.moved(moved)
    return mesh


def _flipped(mesh: TriangleMesh, features: np.ndarray) -> TriangleMesh:
    """The mesh with edges flipped for better triangles, none of the (K, 2) features among them."""
    for _ in range(FLIPS):
        better = flipped(mesh, np.zeros(len(mesh.vertices), dtype=bool))
        kept = HalfEdges.of(better).edges @ np.array([len(mesh.vertices), 1])
        if not np.isin(features @ [len(mesh.vertices), 1], kept).all():
            break
        mesh = better
    return mesh
