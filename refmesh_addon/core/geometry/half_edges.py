"""The half-edge table of a mesh: which faces meet at which edge.

Botsch et al., "Polygon Mesh Processing" (2010), section 2.3; here as flat arrays that handle all edges at once, and for any mesh: an edge
may have any number of faces, with any orientation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..types import FrozenArrays, TriangleMesh
from .ragged import sorted_by_label


@dataclass(frozen=True)
class HalfEdges(FrozenArrays):
    """The H = F K half-edges of faces with K corners: number K f + k runs from corner k of face f to its next corner.

    faces : (F, K) int, indices of vertices; K is 3 for triangles.  vertex_count : V.
    Each table is computed on first use and then kept.

    >>> table = HalfEdges(np.array([[0, 1, 2], [2, 1, 3]]), 4)
    >>> table.edges[table.face_counts == 2].tolist()
    [[1, 2]]
    """

    faces: np.ndarray
    vertex_count: int

    @classmethod
    def of(cls, mesh: TriangleMesh) -> HalfEdges:
        """The table of a triangle mesh."""
        return cls(mesh.triangles, len(mesh.vertices))

    @cached_property
    def start(self) -> np.ndarray:
        """(H,) vertex at which a half-edge starts."""
        return self.faces.ravel()

    @cached_property
    def end(self) -> np.ndarray:
        """(H,) vertex at which a half-edge ends."""
        return np.roll(self.faces, -1, axis=1).ravel()

    @cached_property
    def previous(self) -> np.ndarray:
        """(H,) corner of the face before the start; in a triangle, the corner opposite to the edge."""
        return np.roll(self.faces, 1, axis=1).ravel()

    @cached_property
    def edges(self) -> np.ndarray:
        """(E, 2) int32, each undirected edge once, lower vertex first, in lexicographic order."""
        first = self._by_edge[self._edge_starts]
        return np.column_stack([self._low[first], self._high[first]]).astype(np.int32, copy=False)

    @cached_property
    def face_counts(self) -> np.ndarray:
        """(E,) number of faces at each edge: 2 inside a surface, 1 on its boundary, more where it is not a manifold."""
        return np.diff(self._edge_starts, append=len(self._by_edge))

    @cached_property
    def edge(self) -> np.ndarray:
        """(H,) row of `edges` that a half-edge lies on."""
        result = np.empty(len(self._by_edge), dtype=np.int64)
        result[self._by_edge] = np.repeat(np.arange(len(self._edge_starts)), self.face_counts)
        return result

    @cached_property
    def pairs(self) -> np.ndarray:
        """(P, 2) the half-edges of each edge with exactly two faces, the lower one first, in the order of `edges`."""
        first = self._edge_starts[self.face_counts == 2]
        return np.column_stack([self._by_edge[first], self._by_edge[first + 1]])

    @cached_property
    def _low(self) -> np.ndarray:
        return np.minimum(self.start, self.end)

    @cached_property
    def _high(self) -> np.ndarray:
        return np.maximum(self.start, self.end)

    @cached_property
    def _by_edge(self) -> np.ndarray:
        """(H,) half-edges, edge after edge, ascending within each: a radix sort by the two vertices takes half the time of argsort."""
        by_high, _ = sorted_by_label(self._high, self.vertex_count)
        by_low, _ = sorted_by_label(self._low[by_high], self.vertex_count)
        return by_high[by_low]

    @cached_property
    def _edge_starts(self) -> np.ndarray:
        """(E,) where each edge begins in `_by_edge`."""
        low, high = self._low[self._by_edge], self._high[self._by_edge]
        differs = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
        return np.flatnonzero(np.concatenate([[len(low) > 0], differs]))
