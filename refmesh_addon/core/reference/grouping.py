"""Where a take is cut into groups of frames that share a reference mesh.

A group costs one hand-over, plus the deformation of its bodies: the stress of its frames against the largest distances, over
pairs of centers with affinity, since one mesh serves bodies that merely move. A group in which bodies touch from its first
frame to its last costs more, because none of its frames shows them apart. Dynamic programming finds the cheapest cuts of the
whole take. Where something appears or leaves there is a cut in any case.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

STRESS_COST = 0.02  # root mean square stress of a group's frames that costs as much as one more group
CONTACT_COST = 3.0  # cost, in groups, of touching throughout for all pairs that ever touch
MAX_PAIRS = 5000  # of centers that a cut in two is judged by
TOUCHING = 1.25  # distance, in s, below which centers of different bodies touch


@dataclass(frozen=True)
class Contacts:
    """Pairs of centers without affinity that touch in some frame.

    touching : (F, K) bool, which of the K pairs touch in which frame.
    """

    touching: np.ndarray

    @classmethod
    def of(cls, positions: np.ndarray, affinity: sparse.csr_matrix, spacing: float) -> Contacts:
        """positions : (F, C, 3).  affinity : (C, C), zero between different bodies.  spacing : s, scene units."""
        count = positions.shape[1]
        linked = set(_keys(sparse.triu(affinity, 1).tocoo(), count))
        near = [_near_keys(centers, TOUCHING * spacing, count) for centers in positions]
        pairs = np.array(sorted(set().union(*near) - linked), dtype=np.int64)
        return cls(np.array([np.isin(pairs, sorted(frame)) for frame in near]).reshape(len(positions), len(pairs)))

    def lasting(self, start: int, stop: int) -> float:
        """Pairs that touch in every frame from start to before stop, as a share of the most that ever touch in one frame."""
        most = self.touching.sum(axis=1).max(initial=0)
        return float(self.touching[start:stop].all(axis=0).sum() / most) if most else 0.0


def content_groups(
    positions: np.ndarray, affinity: sparse.csr_matrix, spacing: float, longest: int, cuts: tuple[int, ...] = ()
) -> list[tuple[int, ...]]:
    """Groups of consecutive frames, as tuples of indices, none longer than `longest`.

    positions : (F, C, 3) tracked centers.  affinity : (C, C) weights.  spacing : s.  cuts : frames at which a group must begin.
    Raises ValueError for a longest group below 1.

    >>> at_rest = np.stack([tracked.centers] * 6)
    >>> content_groups(at_rest, tracked.affinity.weights(), tracked.affinity.spacing, longest=4)
    [(0, 1), (2, 3, 4, 5)]
    """
    if longest < 1:
        raise ValueError(f"a group needs at least one frame; got {longest}")
    count = len(positions)
    contacts = Contacts.of(positions, affinity, spacing)
    pairs = sparse.triu(affinity, 1).tocoo()
    distances = np.array([np.linalg.norm(centers[pairs.row] - centers[pairs.col], axis=1) for centers in positions])
    cheapest, start_of = np.full(count + 1, np.inf), np.zeros(count + 1, dtype=int)
    cheapest[0] = 0.0
    for start in range(count):
        end = min([start + longest, count, *(cut for cut in cuts if cut > start)])
        for stop, misfit in enumerate(_misfits(distances[start:end]), start + 1):
            cost = cheapest[start] + 1.0 + misfit + CONTACT_COST * contacts.lasting(start, stop)
            if cost < cheapest[stop]:
                cheapest[stop], start_of[stop] = cost, start
    groups, stop = [], count
    while stop:  # falls: a group begins before it ends
        groups.append(tuple(range(start_of[stop], stop)))
        stop = start_of[stop]
    return groups[::-1]


def least_strained_cut(positions: np.ndarray, affinity: sparse.csr_matrix, candidates: list[int]) -> int:
    """The candidate at which a run of frames is best cut in two: where both parts together have the least stress.

    positions : (F, C, 3) tracked centers.  affinity : (C, C) weights; only pairs with affinity count.  candidates : rows, none of them 0.
    """
    distances = _sampled_distances(positions, affinity)
    missed = lambda part: float(((part.max(axis=0) - part) ** 2).sum())
    return min(candidates, key=lambda start: missed(distances[:start]) + missed(distances[start:]))


def frame_stress(positions: np.ndarray, affinity: sparse.csr_matrix) -> np.ndarray:
    """(F,) squared stress of each frame of a run against the largest distances in it, scene units squared: how much it is deformed.

    positions : (F, C, 3) tracked centers.  affinity : (C, C) weights; only pairs with affinity count.
    """
    distances = _sampled_distances(positions, affinity)
    return ((distances.max(axis=0) - distances) ** 2).sum(axis=1)


def _sampled_distances(positions: np.ndarray, affinity: sparse.csr_matrix) -> np.ndarray:
    """(F, P) distances between MAX_PAIRS pairs of centers with affinity, evenly chosen, or all of them."""
    pairs = sparse.triu(affinity, 1).tocoo()
    chosen = np.unique(np.linspace(0, len(pairs.row) - 1, min(len(pairs.row), MAX_PAIRS)).astype(int))
    first, second = pairs.row[chosen], pairs.col[chosen]
    return np.array([np.linalg.norm(centers[first] - centers[second], axis=1) for centers in positions])


def _misfits(distances: np.ndarray) -> np.ndarray:
    """(F,) cost of a group of the first 1, 2, ... of (F, P) frames: their squared stress against the largest distances."""
    result, largest = np.zeros(len(distances)), np.zeros(distances.shape[1])
    for last, now in enumerate(distances):
        largest = np.maximum(largest, now)
        total = max(float(largest @ largest), np.finfo(float).tiny)
        missed = largest - distances[: last + 1]
        result[last] = np.einsum("fp,fp->", missed, missed) / total / (last + 1) / STRESS_COST**2
    return result


def _near_keys(centers: np.ndarray, reach: float, count: int) -> set[int]:
    first, second = cKDTree(centers).query_pairs(reach, output_type="ndarray").T
    return set((first.astype(np.int64) * count + second).tolist())


def _keys(pairs: sparse.coo_matrix, count: int) -> list[int]:
    return (pairs.row.astype(np.int64) * count + pairs.col).tolist()
