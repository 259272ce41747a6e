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
from ..geometry.mesh import mean_edge_length
from ..geometry.self_intersection import crossing_triangles
from ..types import FrozenArrays, TriangleMesh
from .edge_flips import flipped

REACH = 1.5  # mean edge lengths from a line within which its path runs
DETOUR = 4.0  # cost of an edge a mean edge length off the line, against one on it
SAMPLES = 4  # points on a line per mean edge length, to measure distances from it
LOOP_PARTS = 3  # into which a closed line is divided, so that each has two ends
RINGS, SMOOTHINGS = 2, 12  # rings of vertices beside a line that are spread evenly, and how often
FLIPS = 3  # passes of edge flips at the end


@dataclass(frozen=True)
class FeatureMesh(FrozenArrays):
    """A mesh.  features : (K, 2) int32, those of its edges that lie on feature lines."""

    mesh: TriangleMesh
    features: Annotated[np.ndarray, "(K, 2) int32"]


def with_feature_edges(mesh: TriangleMesh, beside: TriangleMesh, edges: np.ndarray) -> FeatureMesh:
    """The mesh with edges along feature lines, as many vertices and triangles.

    beside : the surface that has the lines.  edges : (E, 2) edges of it, the lines. A line to which no path leads is left out, and
    all of them are where the mesh would come to cross itself.
    """
    nothing = FeatureMesh(mesh, np.zeros((0, 2), dtype=np.int32))
    paths = _Paths(mesh)
    for line in sorted(ordered_lines(beside.vertices, edges), key=len, reverse=True):
        for part in _parts(line):
            paths.lay(part, beside.vertices)
    if not paths.features:
        return nothing
    result = _smoothed_beside(mesh.moved(paths.positions), paths.taken, beside)
    features = np.unique(np.sort(np.concatenate(paths.features), axis=1), axis=0)
    result = _flipped(result, features)
    if crossing_triangles(result).sum() > crossing_triangles(mesh).sum():
        return nothing
    return FeatureMesh(result, features.astype(np.int32))


def _parts(line: np.ndarray) -> list[np.ndarray]:
    """The line, or the parts of a closed one."""
    if line[0] != line[-1]:
        return [line]
    cuts = np.linspace(0, len(line) - 1, LOOP_PARTS + 1).round().astype(int)
    return [line[start : end + 1] for start, end in zip(cuts[:-1], cuts[1:], strict=True)]


class _Paths:
    """The paths laid so far.

    positions : (V, 3) of the vertices.  taken : (V,) bool, vertices on a path.  features : of each path, its (K, 2) edges.
    """

    def __init__(self, mesh: TriangleMesh):
        self._mesh, self._edges = mesh, HalfEdges.of(mesh).edges.astype(np.int64)
        self._lengths = np.linalg.norm(np.diff(mesh.vertices[self._edges], axis=1)[:, 0], axis=1)
        self._length = float(self._lengths.mean())
        self._tree = cKDTree(mesh.vertices)
        self._corners: dict[int, int] = {}
        self.positions, self.taken = mesh.vertices.copy(), np.zeros(len(mesh.vertices), dtype=bool)
        self.features: list[np.ndarray] = []

    def lay(self, line: np.ndarray, points: np.ndarray) -> None:
        """Lays a path along a line, given as indices of (N, 3) points in order."""
        ends = [self._corner(int(end), points) for end in (line[0], line[-1])]
        if ends[0] == ends[1] or min(ends) < 0:
            return
        path = self._path(ends[0], ends[1], _Polyline(points[line]))
        if path is not None:
            self.positions[path] = _Polyline(points[line]).spread(self._mesh.vertices[path])
            self.taken[path] = True
            self._corners |= {int(line[0]): ends[0], int(line[-1]): ends[1]}
            self.features.append(np.column_stack([path[:-1], path[1:]]))

    def _corner(self, number: int, points: np.ndarray) -> int:
        """The vertex at the end of a line: that of a line that ends there already, or the nearest one that is free; -1 for none."""
        if number in self._corners:
            return self._corners[number]
        near = np.array(sorted(self._tree.query_ball_point(points[number], REACH * self._length)), dtype=np.int64)
        near = near[~self.taken[near]]
        return int(near[np.linalg.norm(self._mesh.vertices[near] - points[number], axis=1).argmin()]) if len(near) else -1

    def _path(self, start: int, end: int, line: _Polyline) -> np.ndarray | None:
        """The vertices of the shortest path near a line, whose edges cost more the farther they are from it."""
        usable = np.zeros(len(self.taken), dtype=bool)
        for near in self._tree.query_ball_point(line.samples(self._length / SAMPLES), REACH * self._length):
            usable[near] = True
        usable &= ~self.taken
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


def _smoothed_beside(mesh: TriangleMesh, fixed: np.ndarray, surface: TriangleMesh) -> TriangleMesh:
    """The mesh with the vertices beside (V,) bool fixed ones spread evenly and laid onto the surface that has the lines."""
    index, border, length = SurfaceIndex(surface), border_edges(surface), mean_edge_length(mesh)
    adjacency, free = triangle_adjacency(mesh), fixed.copy()
    for _ in range(RINGS):
        free |= (adjacency @ free) > 0
    free &= ~fixed
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
