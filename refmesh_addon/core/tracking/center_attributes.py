"""Attributes of each tracked center over a whole sequence, by which a person sees what was followed well and what was not."""

from __future__ import annotations

from functools import reduce
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from ..findings import CENTER_ATTRIBUTES
from .irregularity import irregularity
from .neighbors import lasting_pairs, neighbor_pairs


def center_attributes(positions: np.ndarray, spacing: float, marked: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """name -> (C,) for each of CENTER_ATTRIBUTES.

    positions : (F, C, 3).  spacing : s, scene units.  marked : (C,) bodies that must be apart.
    "body" is a number from 0 on, the largest body first; the others are in center spacings.
    """
    pairs = neighbor_pairs(positions[0], spacing)
    values = (
        lasting_bodies(positions, spacing, marked),
        _mean_step(positions) / spacing,
        _stretch(positions, pairs) / spacing,
        np.sqrt(irregularity(positions)) / spacing,
    )
    return dict(zip(CENTER_ATTRIBUTES, values, strict=True))


def lasting_bodies(positions: np.ndarray, spacing: float, marked: np.ndarray | None = None) -> np.ndarray:
    """(C,) number of the body of each center: what stays connected in every frame and is not marked as two bodies.

    positions : (F, C, 3).  spacing : s, scene units.  marked : (C,) bodies that must be apart.
    """
    pairs, _ = lasting_pairs(positions, spacing)
    if marked is not None:
        pairs = pairs[marked[pairs[:, 0]] == marked[pairs[:, 1]]]
    count = positions.shape[1]
    graph = sparse.coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, label = csgraph.connected_components(graph, directed=False)
    order = np.argsort(-np.bincount(label), kind="stable")
    return np.argsort(order)[label]


def _mean_step(positions: np.ndarray) -> np.ndarray:
    """(C,) mean distance that a center goes from frame to frame."""
    if len(positions) < 2:
        return np.zeros(positions.shape[1])
    steps = (np.linalg.norm(after - before, axis=1) for before, after in pairwise(positions))
    return reduce(np.add, steps) / (len(positions) - 1)


def _stretch(positions: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """(C,) mean change of the distance to a neighbor against the first frame, over frames and neighbors; pairs : (N, 2)."""
    count = positions.shape[1]
    if not len(pairs):
        return np.zeros(count)
    first = np.linalg.norm(positions[0][pairs[:, 0]] - positions[0][pairs[:, 1]], axis=1)
    change = np.zeros(len(pairs))
    for frame in positions:
        change += np.abs(np.linalg.norm(frame[pairs[:, 0]] - frame[pairs[:, 1]], axis=1) - first)
    ends, twice = pairs.T.ravel(), np.tile(change / len(positions), 2)
    return np.bincount(ends, twice, count) / np.maximum(np.bincount(ends, minlength=count), 1)
