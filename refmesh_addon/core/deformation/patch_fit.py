"""How well two surface patches fit when one is turned about the key point they share.

The paper, eq. "find key points": min over R of Err(N(i), R(N(r))), subject to r = i.
"""

from __future__ import annotations

import numpy as np

from ..geometry.rotations import closest_rotations
from .patches import Patches

BLOCK_ENTRIES = 1 << 19  # distances between two points held at once: bounds the memory to some 30 MB
ROUNDS = 8  # nearest neighbors, then the best rotation; later rounds hardly change it


def fit_patches(
    reference: Patches, frame: Patches, pairs: tuple[np.ndarray, np.ndarray], starts: np.ndarray, fixed_point: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Err of the paper for N pairs: mean nearest distance from the turned reference patch plus the Hausdorff distance.

    pairs : (N,) reference and (N,) frame key points.  starts : (N, 3, 3) first rotations.

    Returns the smallest error met in a few rounds of nearest neighbors and best rotation (N,), shares of the radius, and the
    rotation that has it (N, 3, 3).
    """
    rows, columns = pairs
    errors, rotations = np.empty(len(rows)), np.empty((len(rows), 3, 3))
    block = max(1, BLOCK_ENTRIES // (reference.offsets.shape[1] * frame.offsets.shape[1]))
    for at in range(0, len(rows), block):
        part = slice(at, at + block)
        moving, target = _Points(reference, rows[part]), _Points(frame, columns[part])
        errors[part], rotations[part] = _refined(moving, target, starts[part], fixed_point)
    return errors / reference.radius, rotations


class _Points:
    """Points (N, n, 3) of chosen patches and weights (N, n): 1, or 0 for padding."""

    def __init__(self, patches: Patches, chosen: np.ndarray):
        self.points = patches.offsets[chosen]
        self.weights = patches.filled[chosen].astype(float)


def _refined(moving: _Points, target: _Points, rotation: np.ndarray, fixed_point: bool) -> tuple[np.ndarray, np.ndarray]:
    best, best_rotation = np.full(len(rotation), np.inf), rotation.copy()
    shift = np.zeros((len(rotation), 3))
    for _ in range(ROUNDS):
        moved = moving.points @ rotation.transpose(0, 2, 1) + shift[:, None]
        there, partner, back, partner_back = _nearest(moved, target.points)
        mean = (there * moving.weights).sum(axis=1) / moving.weights.sum(axis=1)
        error = mean + np.maximum(there.max(axis=1), back.max(axis=1))
        better = error < best
        best[better], best_rotation[better] = error[better], rotation[better]
        # both ways, so that no part of either patch is left without a partner
        source = np.concatenate([moving.points, np.take_along_axis(moving.points, partner_back[:, :, None], axis=1)], axis=1)
        goal = np.concatenate([np.take_along_axis(target.points, partner[:, :, None], axis=1), target.points], axis=1)
        weights = np.concatenate([moving.weights, target.weights], axis=1)
        rotation, shift = _rigid_fit(source, goal, weights / weights.sum(axis=1, keepdims=True), fixed_point)
    return best, best_rotation


def _nearest(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Distance and index of the nearest of (N, m, 3) for each of (N, n, 3), and the other way round."""
    squares = square_distances(a.astype(np.float32), b.astype(np.float32))  # enough to tell which is nearest, in half the time
    there, back = squares.argmin(axis=2), squares.argmin(axis=1)
    to = np.linalg.norm(a - np.take_along_axis(b, there[:, :, None], axis=1), axis=2)
    fro = np.linalg.norm(b - np.take_along_axis(a, back[:, :, None], axis=1), axis=2)
    return to, there, fro, back


def square_distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N, n, m) from (N, n, 3) to (N, m, 3); rounding may leave them slightly below zero."""
    squares = -2.0 * (a @ b.transpose(0, 2, 1))
    squares += np.einsum("nai,nai->na", a, a)[:, :, None]
    squares += np.einsum("nbi,nbi->nb", b, b)[:, None, :]
    return squares


def _rigid_fit(source: np.ndarray, goal: np.ndarray, weights: np.ndarray, fixed_point: bool) -> tuple[np.ndarray, np.ndarray]:
    """Best rotations (N, 3, 3) and shifts (N, 3) of (N, n, 3) points (Kabsch); about the origin, without shift, when it is fixed."""
    free = 0.0 if fixed_point else weights[:, :, None]
    from_middle, to_middle = (free * source).sum(axis=1), (free * goal).sum(axis=1)
    cross = (weights[:, :, None] * (goal - to_middle[:, None])).transpose(0, 2, 1) @ (source - from_middle[:, None])
    rotation = closest_rotations(cross)
    return rotation, to_middle - np.einsum("nij,nj->ni", rotation, from_middle)
