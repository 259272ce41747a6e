"""Bodies that no affinity joins, set apart in the reference positions, so that each is reconstructed by itself.

Distances say how far two bodies part within a group. Where they touch throughout, or part by less than the reconstruction
resolves, one surface would run over both; but bodies that nothing joins may stand anywhere.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

# Least distance between centers of two bodies, in s. Contacts leave holes in both, which close each by itself only where the gap is wide
# against them: with 4 a ball sunk into a box in all frames of a group stayed one with it.
APART = 12.0
# Affinity that joins two centers to one body. The weakest link that holds a limb or a cloth together has more than 0.5 in all
# sequences tried, the strongest that remains between bodies that have been seen apart less than 0.05.
JOINED = 0.1
LEAST_BODY = 20  # centers; fewer are no body but centers astray, which stay with what is nearest
MOST_ROUNDS = 50  # of pushing pairs of bodies, which may push a third


def bodies_of(positions: np.ndarray, affinity: sparse.spmatrix, joined: float = JOINED) -> np.ndarray:
    """(C,) number of the body of each center: components of the affinity graph, small ones counted with what is nearest.

    positions : (C, 3).  affinity : (C, C) symmetric weights.  joined : what joins two centers is more than this.
    """
    _, label = connected_components(affinity > joined, directed=False)
    large = np.bincount(label)[label] >= LEAST_BODY
    if not large.any():
        return np.zeros(len(label), dtype=int)
    nearest = cKDTree(positions[large]).query(positions)[1]
    return np.unique(label[large][nearest], return_inverse=True)[1]


def within_bodies(affinity: sparse.spmatrix, bodies: np.ndarray | None) -> sparse.csr_matrix:
    """The (C, C) affinity without pairs of different bodies, (C,) numbers; as it is where no bodies are given."""
    if bodies is None:
        return affinity
    pairs = affinity.tocoo()
    kept = bodies[pairs.row] == bodies[pairs.col]
    return sparse.csr_matrix((pairs.data[kept], (pairs.row[kept], pairs.col[kept])), pairs.shape)


def set_apart(positions: np.ndarray, body: np.ndarray, spacing: float) -> np.ndarray:
    """(C, 3) positions in which centers of different bodies are at least APART spacings from each other, each body moved as a whole.

    positions : (C, 3), scene units.  body : (C,) numbers from 0, as `bodies_of` gives them.  spacing : s.
    Of two bodies the smaller moves further, by their counts. Bodies that enclose each other may stay nearer.
    """
    count = np.bincount(body)
    for _ in range(MOST_ROUNDS):
        pushed = np.zeros((len(count), 3))
        for first in range(len(count)):
            for second in range(first + 1, len(count)):
                push = _push(positions[body == first], positions[body == second], APART * spacing)
                pushed[first] -= push * count[second] / (count[first] + count[second])
                pushed[second] += push * count[first] / (count[first] + count[second])
        if not pushed.any():
            break
        positions = positions + pushed[body]
    return positions


def _push(first: np.ndarray, second: np.ndarray, least: float) -> np.ndarray:
    """(3,) way for the second body that brings it about as far from the first as it is to be."""
    distance, partner = cKDTree(first).query(second, distance_upper_bound=least * (1 - 1e-6))
    near = np.flatnonzero(np.isfinite(distance))
    if not len(near):
        return np.zeros(3)
    # The nearest pairs say which way is out; the middles decide where pairs point every way, as inside a ring.
    away = ((second[near] - first[partner[near]]) * (least - distance[near])[:, None]).sum(axis=0)
    away = away + 1e-9 * (second.mean(axis=0) - first.mean(axis=0))
    length = np.linalg.norm(away)
    return (least - distance.min()) * away / length if length > 0 else np.zeros(3)
