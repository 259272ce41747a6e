"""Which of two sets of centers in the same frame stand for each other, so that numbers go on from one to the next."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import min_weight_full_bipartite_matching
from scipy.spatial import cKDTree

NEIGHBOURS = 24  # partners considered for each center; a whole matching among so few nearly always exists


def matched(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Index (C,) into `after` of each center's partner: the one-to-one matching with the least sum of squared distances.

    before, after : (C, 3) centers of one frame, scene units. Only near partners are considered, unless no whole matching
    is found among them. Raises ValueError when the shapes differ.
    """
    if before.shape != after.shape:
        raise ValueError(f"before and after must have the same shape; got {before.shape} and {after.shape}")
    count = len(before)
    distance, nearest = cKDTree(after).query(before, k=min(NEIGHBOURS, count))
    distance, nearest = distance.reshape(count, -1), nearest.reshape(count, -1)
    cost = 1.0 + distance**2 / max(float(np.mean(distance**2)), np.finfo(float).tiny)  # a sparse matrix must not hold zeros
    rows = np.repeat(np.arange(count), nearest.shape[1])
    try:
        return min_weight_full_bipartite_matching(csr_matrix((cost.ravel(), (rows, nearest.ravel())), (count, count)))[1]
    except ValueError:  # no whole matching among the neighbours
        return linear_sum_assignment(((before[:, None] - after[None]) ** 2).sum(axis=2))[1]
