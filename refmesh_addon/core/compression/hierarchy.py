"""Levels of vertices, coarse to fine, from the triangles alone, so that a decoder knows them before any position.

As in Dobkin & Kirkpatrick, "Fast detection of polyhedral intersection", TCS 1983: from level to coarser level an independent set of
vertices goes, each into one of its neighbors (half-edge collapse). Whatever the triangles are, manifold or not, this ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..types import FrozenArrays

HIGHEST_VALENCE = 8  # of a vertex that goes: the star that closes its hole stays small
ROUNDS = 4  # in which an independent set grows; more add next to nothing
COARSEST = 48  # vertices of the coarsest level
LEAST_SHARE = 0.02  # of the vertices that a further level must remove
_HASH, _HASH_BITS = 2654435761, 32  # Knuth's multiplicative hash: breaks ties without a direction


@dataclass(frozen=True)
class Level(FrozenArrays):
    """One level: the vertices that a coarser one lacks, and the mesh that they are part of.

    fine : (U,) int64, vertices to predict here; no two of them are neighbors.
    triangles : (T, 3) int64, the level's triangles over the numbers of the whole mesh.
    adjacency : (V, V) sparse, ones between the neighbors of this level.
    """

    fine: np.ndarray
    triangles: np.ndarray
    adjacency: sparse.csr_matrix


@dataclass(frozen=True)
class Hierarchy(FrozenArrays):
    """coarsest : (C,) int64, vertices without a level.  levels : coarse to fine; every other vertex is in one of them."""

    coarsest: np.ndarray
    levels: tuple[Level, ...]


def vertex_hierarchy(triangles: np.ndarray, count: int) -> Hierarchy:
    """The levels of (T, 3) triangles over `count` vertices; the same on every platform."""
    left, remaining, levels = triangles.astype(np.int64), np.ones(count, dtype=bool), []
    while remaining.sum() > COARSEST:  # each round removes at least LEAST_SHARE
        adjacency = neighbors(left, count)
        fine = _independent(adjacency, remaining)
        if len(fine) < LEAST_SHARE * remaining.sum():
            break
        levels.append(Level(fine, left, adjacency))
        remaining[fine] = False
        left = _collapsed(left, fine, adjacency)
    return Hierarchy(np.flatnonzero(remaining), tuple(reversed(levels)))


def neighbors(triangles: np.ndarray, count: int) -> sparse.csr_matrix:
    """(V, V) ones between vertices that share a triangle, indices sorted."""
    start, end = triangles[:, [0, 1, 2, 1, 2, 0]].ravel(), triangles[:, [1, 2, 0, 0, 1, 2]].ravel()
    keys = np.unique((start * count + end)[start != end])
    rows, columns = np.divmod(keys, max(count, 1))
    starts = np.searchsorted(rows, np.arange(count + 1))
    return sparse.csr_matrix((np.ones(len(keys)), columns, starts), shape=(count, count))


def _independent(adjacency: sparse.csr_matrix, remaining: np.ndarray) -> np.ndarray:
    """Vertices of low valence, no two of them neighbors, ascending."""
    valence = np.diff(adjacency.indptr)
    hashed = np.arange(len(remaining)) * _HASH % (1 << _HASH_BITS)
    order = np.lexsort([np.arange(len(remaining)), hashed, valence])
    rank = np.empty(len(remaining), dtype=np.int64)
    rank[order] = np.arange(len(remaining))
    rank[~remaining | (valence > HIGHEST_VALENCE) | (valence == 0)] = len(remaining)
    chosen = np.zeros(len(remaining), dtype=bool)
    for _ in range(ROUNDS):
        new = (rank < _least_around(adjacency, rank)) & (rank < len(remaining))
        chosen |= new
        rank[new | (adjacency @ new > 0)] = len(remaining)
    return np.flatnonzero(chosen)


def _least_around(adjacency: sparse.csr_matrix, values: np.ndarray) -> np.ndarray:
    """(V,) least value of the neighbors, more than any where there are none."""
    empty = np.iinfo(np.int64).max
    gathered = np.append(values[adjacency.indices], empty)  # the last list would else begin beyond the end where it is empty
    least = np.minimum.reduceat(gathered, adjacency.indptr[:-1])
    return np.where(np.diff(adjacency.indptr) > 0, least, empty)


def _collapsed(triangles: np.ndarray, fine: np.ndarray, adjacency: sparse.csr_matrix) -> np.ndarray:
    """The triangles that are left when each fine vertex goes into its neighbor of the lowest valence."""
    count = adjacency.shape[0]
    ranked = np.diff(adjacency.indptr).astype(np.int64) * count + np.arange(count)
    target = np.arange(count)
    target[fine] = _least_around(adjacency, ranked)[fine] % count
    renamed = target[triangles]
    whole = (renamed[:, 0] != renamed[:, 1]) & (renamed[:, 1] != renamed[:, 2]) & (renamed[:, 2] != renamed[:, 0])
    return renamed[whole]
