"""A reference mesh whose edges are as long as the frames show them, where they are shorter in the reference positions.

Cloth that is folded in the reference positions has less surface there than in the frames. Fitted to these, its triangles would be stretched
several times, and creases come out as saws.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy import sparse

from ..geometry.factor import factored
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import edge_lengths, triangles_at
from ..geometry.self_intersection import crossing_triangles
from ..geometry.vectors import TINY
from ..types import TriangleMesh
from .refinement import FittedFrame

# Factor by which an edge is longer in the frames than at rest; less is the play of single fits. Edges that are shorter there keep their
# lengths: near contacts, those of a ball and its box were shortened so that triangles flipped in other frames.
LONGER = 1.2
SHORTEST = 0.1  # mean edges, of an edge for its weight: that of a sliver must not outweigh all others
STAY = 0.05  # weight of a vertex's place against an edge's length, in edges of mean weight: shapes stay where no length changes
ITERATIONS = 20  # the last one changes the lengths of the dancer's lengthened edges by less than a thousandth, in the median
ROUNDS = 5  # of putting back what would cross


def with_frame_lengths(mesh: TriangleMesh, frames: Iterable[FittedFrame]) -> TriangleMesh:
    """The mesh with vertices moved so that edges which the frames lengthen have the root mean square of their lengths there, or itself.

    Lengths and places are alternately solved for, as springs are in Liu et al., "Fast Simulation of Mass-Spring Systems" (SIGGRAPH Asia
    2013). Nothing moves where triangles would cross that did not before.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> with_frame_lengths(square, []) is square
    True
    """
    edges = HalfEdges.of(mesh).edges
    own = edge_lengths(mesh.vertices, edges)
    lengths = _frame_lengths(edges, own, frames)
    if np.array_equal(lengths, own):
        return mesh
    return _without_crossings(mesh, _relaxed(mesh.vertices, edges, lengths, SHORTEST * own.mean()))


def _frame_lengths(edges: np.ndarray, own: np.ndarray, frames: Iterable[FittedFrame]) -> np.ndarray:
    """(E,) lengths of (E, 2) edges in the frames that show both ends; their own where these are not much longer."""
    squares, counts = np.zeros(len(edges)), np.zeros(len(edges))
    for frame in frames:
        shown = frame.visible[edges].all(axis=1)
        squares += np.where(shown, edge_lengths(frame.vertices, edges) ** 2, 0.0)
        counts += shown
    there = np.sqrt(squares / np.maximum(counts, 1))
    changed = (counts > 0) & (there > LONGER * own)
    return np.where(changed, there, own)


def _relaxed(vertices: np.ndarray, edges: np.ndarray, lengths: np.ndarray, shortest: float) -> np.ndarray:
    """(R, 3) places in which edges have about these (E,) lengths."""
    weights = 1.0 / np.maximum(lengths, shortest)
    weights /= weights.mean()
    rows = np.arange(len(edges))
    signs = np.repeat([1.0, -1.0], len(edges))
    spans_of = sparse.csr_matrix((signs, (np.tile(rows, 2), edges.T.ravel())), (len(edges), len(vertices)))
    pull = (spans_of.T @ sparse.diags(weights)).tocsr()
    system = factored(pull @ spans_of + STAY * sparse.identity(len(vertices)))
    for _ in range(ITERATIONS):
        spans = spans_of @ vertices
        goals = spans * (lengths / np.maximum(np.linalg.norm(spans, axis=1), TINY))[:, None]
        vertices = system.solve(pull @ goals + STAY * vertices)
    return vertices


def _without_crossings(mesh: TriangleMesh, vertices: np.ndarray) -> TriangleMesh:
    """The mesh at (R, 3) vertices, with its own where triangles would cross that do not in it; itself where that does not help."""
    before = crossing_triangles(mesh)
    for _ in range(ROUNDS):
        crossing = crossing_triangles(mesh.moved(vertices)) & ~before
        if not crossing.any():
            return mesh.moved(vertices)
        back = np.zeros(len(vertices), dtype=bool)
        back[mesh.triangles[crossing]] = True
        back[mesh.triangles[triangles_at(mesh, back)]] = True
        vertices = np.where(back[:, None], mesh.vertices, vertices)
    return mesh
