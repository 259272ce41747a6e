"""Figures of each tracked center over a whole sequence, by which a person sees what was followed well and what was not."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph
from scipy.spatial import cKDTree

from .findings import FIGURES
from .global_optimization import irregularity

NEAR = 1.75  # center spacings between neighbours; the affinity of two centers has fallen to one half there
APART = 3.0  # center spacings beyond which neighbours have parted


def center_figures(positions: np.ndarray, spacing: float) -> dict[str, np.ndarray]:
    """name -> (C,) for each of FIGURES. positions : (F, C, 3).  spacing : s, scene units.

    "body" is a number from 0 on, the largest body first; the others are in center spacings.
    """
    pairs = _neighbours(positions[0], spacing)
    found = (
        _bodies(positions, pairs, spacing),
        _mean_step(positions) / spacing,
        _stretch(positions, pairs) / spacing,
        np.sqrt(irregularity(positions)) / spacing,
    )
    return dict(zip(FIGURES, found, strict=True))


def _neighbours(centers: np.ndarray, spacing: float) -> np.ndarray:
    """(N, 2) pairs of centers that are near each other."""
    return cKDTree(centers).query_pairs(NEAR * spacing, output_type="ndarray")


def _bodies(positions: np.ndarray, pairs: np.ndarray, spacing: float) -> np.ndarray:
    """(C,) label of what hangs together in every frame."""
    together = np.ones(len(pairs), dtype=bool)
    for frame in positions:
        together &= np.linalg.norm(frame[pairs[:, 0]] - frame[pairs[:, 1]], axis=1) < APART * spacing
    count = positions.shape[1]
    kept = pairs[together]
    graph = sparse.coo_matrix((np.ones(len(kept)), (kept[:, 0], kept[:, 1])), shape=(count, count))
    _, label = csgraph.connected_components(graph, directed=False)
    order = np.argsort(-np.bincount(label), kind="stable")
    return np.argsort(order)[label]


def _mean_step(positions: np.ndarray) -> np.ndarray:
    if len(positions) < 2:
        return np.zeros(positions.shape[1])
    return np.mean([np.linalg.norm(after - before, axis=1) for before, after in zip(positions[:-1], positions[1:])], axis=0)


def _stretch(positions: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """(C,) mean over frames and neighbours of how much longer or shorter than at first the way to a neighbour is."""
    count = positions.shape[1]
    if not len(pairs):
        return np.zeros(count)
    first = np.linalg.norm(positions[0][pairs[:, 0]] - positions[0][pairs[:, 1]], axis=1)
    change = np.zeros(len(pairs))
    for frame in positions:
        change += np.abs(np.linalg.norm(frame[pairs[:, 0]] - frame[pairs[:, 1]], axis=1) - first)
    ends, twice = pairs.T.ravel(), np.tile(change / len(positions), 2)
    return np.bincount(ends, twice, count) / np.maximum(np.bincount(ends, minlength=count), 1)
