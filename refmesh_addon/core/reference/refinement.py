"""Smaller triangles where the frames stretch a reference mesh, so that they are of one size there and not only at rest.

Cloth that unfolds has little surface in the reference positions. The deformed triangles are long there, and hems come out as saws.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import edge_lengths, mean_edge_length
from ..geometry.subdivision import split_edges
from ..types import FrozenArrays, TriangleMesh
from .group import ReferenceMesh

LONGEST = 1.6  # mean edge lengths, of an edge in a frame; of a regular mesh at rest hardly any is as long
STRETCHED = 1.2  # factor by which such an edge is longer than at rest: others are long because the remeshing left them so
ROUNDS = 4  # of splits, each of which halves edges
MOST = 0.15  # edges that are split, as a share of all: where more of the mesh is stretched, triangles are not what it lacks


@dataclass(frozen=True)
class FittedFrame(FrozenArrays):
    """A reference mesh in one frame.

    vertices : (R, 3) scene units.  visible : (R,) bool, those that the frame's surface has placed. Others, in contacts or over holes, are
    stretched between these; more triangles would only fold there.
    """

    vertices: np.ndarray
    visible: np.ndarray


def refined(reference: ReferenceMesh, frames: Iterable[FittedFrame], rest: np.ndarray | None = None) -> ReferenceMesh:
    """The reference mesh with those edges split in the middle that some frame stretches; itself where there are none.

    frames : the mesh in some of them, read one after the other in each round. New vertices come after those that there are.
    rest : (R, 3) vertices that frames are compared with, where those of the mesh have been moved for these; None for the mesh's own.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> still = ReferenceMesh(square, 0)
    >>> refined(still, [FittedFrame(square.vertices, np.ones(4, dtype=bool))]) is still
    True
    """
    start = reference.mesh
    still = FittedFrame(start.vertices if rest is None else rest, np.ones(len(start.vertices), dtype=bool))
    budget = int(MOST * len(HalfEdges.of(start).edges))
    splits: list[np.ndarray] = []
    for _ in range(ROUNDS):
        table = HalfEdges.of(reference.mesh)
        split = largest(_stretched(table.edges, start, still, frames, splits), budget)
        if not split.any():
            break
        budget -= int(split.sum())
        splits.append(table.edges[split])
        reference = with_split_edges(reference, table, split)
    return reference


def with_split_edges(reference: ReferenceMesh, table: HalfEdges, split: np.ndarray) -> ReferenceMesh:
    """The reference mesh with the edges marked in (E,) bool `split` divided in the middle, feature edges too.  table : of its mesh."""
    edges, count = table.edges[split], len(reference.mesh.vertices)
    on_cap = np.flatnonzero(np.isin(edges, reference.caps).all(axis=1))
    caps = np.append(reference.caps, count + on_cap).astype(np.int32)
    return replace(reference, mesh=split_edges(reference.mesh, table, split), features=_halved(reference.features, edges, count), caps=caps)


def largest(sizes: np.ndarray, count: int) -> np.ndarray:
    """(E,) bool, the largest of (E,) sizes above 0, at most so many."""
    result = np.zeros(len(sizes), dtype=bool)
    result[np.argsort(-sizes, kind="stable")[:count]] = True
    return result & (sizes > 0)


def _stretched(
    edges: np.ndarray, start: TriangleMesh, rest: FittedFrame, frames: Iterable[FittedFrame], splits: Sequence[np.ndarray]
) -> np.ndarray:
    """(E,) largest length of each of (E, 2) edges in a frame, in mean edge lengths; 0 where no frame stretches it.

    start : the mesh before any edge was split.  rest, frames : it at rest and then in each frame.  splits : the edges that were split
    since, (S, 2) in each round.
    """
    at_rest = _sizes(edges, start, rest, splits)
    there = reduce(np.maximum, (_sizes(edges, start, frame, splits) for frame in frames))
    return np.where((there > LONGEST) & (there > STRETCHED * at_rest), there, 0.0)


def _sizes(edges: np.ndarray, start: TriangleMesh, state: FittedFrame, splits: Sequence[np.ndarray]) -> np.ndarray:
    """(E,) length of each of (E, 2) edges in a frame, in mean edge lengths of the mesh before any was split; 0 where it is not visible."""
    length = mean_edge_length(start.moved(state.vertices))
    for ends in splits:
        state = _with_middles(state, ends)
    return edge_lengths(state.vertices, edges) / length * state.visible[edges].all(axis=1)


def _with_middles(state: FittedFrame, edges: np.ndarray) -> FittedFrame:
    """The same with a vertex in the middle of each of (S, 2) edges."""
    vertices = np.concatenate([state.vertices, state.vertices[edges].mean(axis=1)])
    return FittedFrame(vertices, np.concatenate([state.visible, state.visible[edges].all(axis=1)]))


def _halved(features: np.ndarray, split: np.ndarray, count: int) -> np.ndarray:
    """(K, 2) int32 feature edges with two in place of each that is split.

    split : (S, 2) edges in order, lower vertex first, whose new vertices have the numbers from `count` on.
    """
    features, names = np.sort(features.astype(np.int64), axis=1), split @ np.array([count, 1], dtype=np.int64)
    own = features @ np.array([count, 1], dtype=np.int64)
    place = np.searchsorted(names, own)
    on_split = np.isin(own, names)
    middle = count + place[on_split]
    halves = [np.column_stack([features[on_split, end], middle]) for end in (0, 1)]
    return np.concatenate([features[~on_split], *halves]).astype(np.int32)
