"""Irregular centers: trajectories isolated from all others, which global optimization drops (Dvorak et al., ICCS 2023)."""

from __future__ import annotations

import numpy as np

from ..geometry.vectors import row_dot

MAX_DROPPED_SHARE = 0.005  # of the centers at a time, 5 of 1000; published 5 to 10
IRREGULAR = 1.5  # times the median distance to the nearest trajectory: an even spread alone stays below 1.3
ROWS_AT_ONCE = 512  # of the (C, C) table of distances between trajectories: bounds its memory


def irregularity(positions: np.ndarray) -> np.ndarray:
    """(C,) mean over the frames of the squared distance to the nearest other trajectory, units squared; 0 for a single one.

    positions : (F, C, 3) scene units.
    """
    frames, count, _ = positions.shape
    if count < 2:
        return np.zeros(count)
    trajectories = np.empty((count, frames, 3))
    for frame, centers in enumerate(positions):
        trajectories[:, frame] = centers - centers.mean(axis=0)  # far coordinates would cost digits
    return np.maximum(_nearest_squared(trajectories.reshape(count, -1)), 0) / frames


def regular_centers(positions: np.ndarray) -> np.ndarray:
    """Indices (C',), ascending, of the trajectories to keep: all but the few most irregular ones. positions : (F, C, 3)."""
    distance = np.sqrt(irregularity(positions))
    most = int(np.ceil(MAX_DROPPED_SHARE * len(distance)))
    worst = np.argsort(-distance, kind="stable")[:most]
    return np.setdiff1d(np.arange(len(distance)), worst[distance[worst] > IRREGULAR * np.median(distance)])


def _nearest_squared(trajectories: np.ndarray) -> np.ndarray:
    """(C,) squared distance of each of (C, 3 F) trajectories from the nearest other one; rounding may leave it just below 0."""
    count = len(trajectories)
    length = row_dot(trajectories, trajectories)
    nearest = np.empty(count)
    for start in range(0, count, ROWS_AT_ONCE):
        rows = np.arange(start, min(start + ROWS_AT_ONCE, count))
        squared = length[rows, None] + length - 2 * trajectories[rows] @ trajectories.T
        squared[rows - start, rows] = np.inf
        nearest[rows] = squared.min(axis=1)
    return nearest
