"""Which centers of two sets in the same frame correspond, so that centers keep their numbers from one group to the next."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import min_weight_full_bipartite_matching
from scipy.spatial import cKDTree

NEIGHBORS = 24  # candidates for the partner of each center; a full matching among so few nearly always exists


def assignment(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Index (C,) into `after` of each center's partner: the one-to-one assignment with the least sum of squared distances.

    before, after : (C, 3) centers of one frame, scene units. Only near candidates are considered, unless they admit no full
    matching. Raises ValueError when the shapes differ.
    """
    if before.shape != after.shape:
        raise ValueError(f"before and after must have the same shape; got {before.shape} and {after.shape}")
    count = len(before)
    distance, nearest = cKDTree(after).query(before, k=min(NEIGHBORS, count))
    distance, nearest = distance.reshape(count, -1), nearest.reshape(count, -1)
    cost = 1.0 + distance**2 / max(float(np.mean(distance**2)), np.finfo(float).tiny)  # a sparse matrix must not hold zeros
    rows = np.repeat(np.arange(count), nearest.shape[1])
    try:
        return min_weight_full_bipartite_matching(csr_matrix((cost.ravel(), (rows, nearest.ravel())), (count, count)))[1]
    except ValueError:  # SciPy's word for: the candidates admit no full matching
        return linear_sum_assignment(((before[:, None] - after[None]) ** 2).sum(axis=2))[1]
