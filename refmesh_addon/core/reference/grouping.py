"""Where a take is cut into groups of frames that share a reference mesh.

A group costs one hand-over, plus the deformation of its bodies: the stress of its frames against the largest distances, over
pairs of centers with affinity, since one mesh serves bodies that merely move. A group in which bodies touch from its first
frame to its last costs more, because none of its frames shows them apart. Dynamic programming finds the cheapest cuts of the
whole take. Where something appears or leaves there is a cut in any case.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial, reduce
from itertools import accumulate, islice

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

STRESS_COST = 0.02  # root mean square stress of a group's frames that costs as much as one more group
CONTACT_COST = 3.0  # cost, in groups, of touching throughout for all pairs that ever touch
MAX_PAIRS = 5000  # of centers that a cut in two is judged by
TOUCHING = 1.25  # distance, in s, below which centers of different bodies touch


@dataclass(frozen=True)
class Contacts:
    """Pairs of centers without affinity that touch.

    touching : (K,) int64 for each frame, which of all pairs touch there, by ascending number.
    """

    touching: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, positions: np.ndarray, affinity: sparse.csr_matrix, spacing: float) -> Contacts:
        """positions : (F, C, 3).  affinity : (C, C), zero between different bodies.  spacing : s, scene units."""
        pairs, count = sparse.triu(affinity, 1).tocoo(), positions.shape[1]
        linked = np.append(np.sort(_numbers(np.column_stack([pairs.row, pairs.col]), count)), np.iinfo(np.int64).max)
        near = (cKDTree(centers).query_pairs(TOUCHING * spacing, output_type="ndarray") for centers in positions)
        numbers = (np.sort(_numbers(pair, count)) for pair in near)
        return cls(tuple(own[linked[np.searchsorted(linked, own)] != own] for own in numbers))

    @cached_property
    def most(self) -> int:
        """The most pairs that touch in one frame."""
        return max(map(len, self.touching))

    def lasting(self, start: int, stop: int) -> list[float]:
        """Pairs that touch in every frame from start on, up to each frame before stop, as shares of the most in one frame."""
        lasting = accumulate(self.touching[start:stop], partial(np.intersect1d, assume_unique=True))
        return [len(pairs) / self.most if self.most else 0.0 for pairs in lasting]


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
    count, later = len(positions), sorted({*cuts, len(positions)})
    contacts, distances = Contacts.of(positions, affinity, spacing), _distances(positions, sparse.triu(affinity, 1).tocoo())
    reached: deque[np.ndarray] = deque()  # distances in the frames of the longest group that begins with a frame
    cheapest, start_of = np.full(count + 1, np.inf), np.zeros(count + 1, dtype=int)
    cheapest[0] = 0.0
    for start in range(count):
        end = min(start + longest, later[bisect_right(later, start)])
        reached.extend(islice(distances, end - start - len(reached)))
        rows = zip(_misfits(np.array(reached)), contacts.lasting(start, end), strict=True)
        for stop, (misfit, lasting) in enumerate(rows, start + 1):
            cost = cheapest[start] + 1.0 + misfit + CONTACT_COST * lasting
            if cost < cheapest[stop]:
                cheapest[stop], start_of[stop] = cost, start
        reached.popleft()
    groups, stop = [], count
    while stop:  # falls: a group begins before it ends
        groups.append(tuple(range(start_of[stop], stop)))
        stop = start_of[stop]
    return groups[::-1]


def least_strained_cut(positions: np.ndarray, affinity: sparse.csr_matrix, candidates: list[int]) -> int:
    """The candidate at which a run of frames is best cut in two: where both parts together have the least stress.

    positions : (F, C, 3) tracked centers.  affinity : (C, C) weights; only pairs with affinity count.  candidates : rows, none of them 0.
    """
    pairs, first = _sampled(affinity), positions[:1]
    before, after = (_running_stress(_distances(rows, pairs), next(_distances(first, pairs))) for rows in (positions, positions[::-1]))
    return min(candidates, key=lambda start: before[start - 1] + after[len(positions) - start - 1])


def frame_stress(positions: np.ndarray, affinity: sparse.csr_matrix) -> np.ndarray:
    """(F,) squared stress of each frame of a run against the largest distances in it, scene units squared: how much it is deformed.

    positions : (F, C, 3) tracked centers.  affinity : (C, C) weights; only pairs with affinity count.
    """
    pairs = _sampled(affinity)
    largest = reduce(np.maximum, _distances(positions, pairs))
    return np.array([((largest - now) ** 2).sum() for now in _distances(positions, pairs)])


def _sampled(affinity: sparse.csr_matrix) -> sparse.coo_matrix:
    """MAX_PAIRS pairs of centers with affinity, evenly chosen, or all of them."""
    pairs = sparse.triu(affinity, 1).tocoo()
    chosen = np.unique(np.linspace(0, len(pairs.row) - 1, min(len(pairs.row), MAX_PAIRS)).astype(int))
    return sparse.coo_matrix((pairs.data[chosen], (pairs.row[chosen], pairs.col[chosen])), pairs.shape)


def _distances(positions: np.ndarray, pairs: sparse.coo_matrix) -> Iterator[np.ndarray]:
    """(P,) distances between pairs of centers, frame by frame: those of a long take would fill the memory."""
    return (np.linalg.norm(centers[pairs.row] - centers[pairs.col], axis=1) for centers in positions)


def _running_stress(distances: Iterable[np.ndarray], zero: np.ndarray) -> list[float]:
    """Squared stress of the first 1, 2, ... frames against their largest distances, from sums, so that no frame is read again.

    zero : (P,) distances from which all are counted, as sums of squares of large numbers cost digits.
    """
    largest, total, squares, stress = np.full(len(zero), -np.inf), np.zeros(len(zero)), 0.0, []
    for count, now in enumerate(distances, 1):
        change = now - zero
        largest, total, squares = np.maximum(largest, change), total + change, squares + float(change @ change)
        stress.append(float(count * largest @ largest - 2 * largest @ total) + squares)
    return stress


def _misfits(distances: np.ndarray) -> np.ndarray:
    """(F,) cost of a group of the first 1, 2, ... of (F, P) frames: their squared stress against the largest distances."""
    result, largest = np.zeros(len(distances)), np.zeros(distances.shape[1])
    for last, now in enumerate(distances):
        largest = np.maximum(largest, now)
        total = max(float(largest @ largest), np.finfo(float).tiny)
        missed = largest - distances[: last + 1]
        result[last] = np.einsum("fp,fp->", missed, missed) / total / (last + 1) / STRESS_COST**2
    return result


def _numbers(pairs: np.ndarray, count: int) -> np.ndarray:
    """(N,) int64 number of each of (N, 2) pairs of `count` centers."""
    return pairs[:, 0].astype(np.int64) * count + pairs[:, 1]
