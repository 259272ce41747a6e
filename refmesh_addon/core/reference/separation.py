"""Separation of bodies that no affinity joins, so that each is reconstructed by itself.

The largest distances keep two bodies as far apart as they get within a group. Where they touch throughout, or part by less
than the reconstruction resolves, one surface would cover both; but bodies that nothing joins may be placed anywhere.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

# Least distance between centers of two bodies, in s. A contact leaves a hole in both, and these are closed separately only where the
# gap is wide compared to them: with 4 a ball that was sunk into a box in all frames of a group stayed connected to it.
MIN_GAP = 12.0
# Affinity that joins two centers to one body. In all sequences tried the weakest link of a limb or a cloth has more than 0.5, the
# strongest that remains between bodies that have been apart less than 0.05.
JOINED = 0.1
MIN_BODY = 20  # centers; fewer are isolated centers rather than a body, and count with the nearest one
MAX_ROUNDS = 50  # of pushing pairs of bodies, which may run into a third
TIE_BREAK = 1e-9  # weight of the direction between centroids against that of the nearest pairs
ROUNDING = 1e-6  # share of the gap by which bodies that were pushed apart may miss it


def bodies_of(positions: np.ndarray, affinity: sparse.spmatrix, joined: float = JOINED) -> np.ndarray:
    """(C,) number of the body of each center: components of the affinity graph, small ones counted with the nearest body.

    positions : (C, 3).  affinity : (C, C) symmetric weights.  joined : affinity above which two centers are joined.
    """
    _, label = connected_components(affinity > joined, directed=False)
    large = np.bincount(label)[label] >= MIN_BODY
    if not large.any():
        return np.zeros(len(label), dtype=int)
    nearest = cKDTree(positions[large]).query(positions)[1]
    return np.unique(label[large][nearest], return_inverse=True)[1]


def within_bodies(affinity: sparse.spmatrix, bodies: np.ndarray | None) -> sparse.csr_matrix:
    """The (C, C) affinity without pairs of different bodies, (C,) numbers; unchanged where no bodies are given."""
    if bodies is None:
        return affinity
    pairs = affinity.tocoo()
    kept = bodies[pairs.row] == bodies[pairs.col]
    return sparse.csr_matrix((pairs.data[kept], (pairs.row[kept], pairs.col[kept])), pairs.shape)


def separated(positions: np.ndarray, body: np.ndarray, spacing: float) -> np.ndarray:
    """(C, 3) positions in which centers of different bodies are at least MIN_GAP spacings from each other, each body moved as a whole.

    positions : (C, 3), scene units.  body : (C,) numbers from 0, as `bodies_of` gives them.  spacing : s.
    Of two bodies the smaller moves further, in proportion to their counts. Bodies that enclose each other may stay nearer.
    """
    count = np.bincount(body)
    for _ in range(MAX_ROUNDS):
        pushed = np.zeros((len(count), 3))
        for first in range(len(count)):
            for second in range(first + 1, len(count)):
                push = _push(positions[body == first], positions[body == second], MIN_GAP * spacing)
                pushed[first] -= push * count[second] / (count[first] + count[second])
                pushed[second] += push * count[first] / (count[first] + count[second])
        if not pushed.any():
            break
        positions = positions + pushed[body]
    return positions


def _push(first: np.ndarray, second: np.ndarray, least: float) -> np.ndarray:
    """(3,) translation of the second body that brings it to about the `least` distance from the first; zero where it is that far."""
    distance, partner = cKDTree(first).query(second, distance_upper_bound=least * (1 - ROUNDING))
    near = np.flatnonzero(np.isfinite(distance))
    if not len(near):
        return np.zeros(3)
    # The nearest pairs give the direction; the centroids decide where pairs point in all directions, as inside a ring.
    direction = ((second[near] - first[partner[near]]) * (least - distance[near])[:, None]).sum(axis=0)
    direction = direction + TIE_BREAK * (second.mean(axis=0) - first.mean(axis=0))
    length = np.linalg.norm(direction)
    return (least - distance.min()) * direction / length if length > 0 else np.zeros(3)
