"""Partners of the reference key points among the key points of a frame.

The paper, section "As-rigid-as-possible deformation re-meshing", eq. "find key points": patches are laid on each other so that the
two key points coincide and may only be turned about that point. The fixed point is what tells the palm from the back of
the hand: both sides of a thin hand have nearly the same points around them, but not around the same point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..types import FrozenArrays
from .patch_fit import fit_patches, square_distances
from .patches import Patches

COARSE_POINTS = 16  # of each reference patch, when many starts are looked through
REFINED = 8  # pairs and starts refined for each reference key point of an unlimited search


@dataclass(frozen=True)
class MatchSettings:
    """Radii and errors are multiples of the patch radius.

    guided : candidates are the key points near the predicted place; otherwise all key points of the frame, as in the paper.
    reach : how far from the predicted place a candidate may lie.
    threshold : largest error of a match (sigma_th in the paper).
    fixed_point : key points stay on each other; False is the earlier method, the best rigid fit of the patches.
    """

    guided: bool = True
    reach: float = 0.25
    threshold: float = 0.4
    fixed_point: bool = True


@dataclass(frozen=True)
class Matches(FrozenArrays):
    """reference, frame : (M,) int64, positions in the lists of key points.  errors : (M,) share of the patch radius."""

    reference: np.ndarray
    frame: np.ndarray
    errors: np.ndarray


def in_reach(positions: np.ndarray, places: np.ndarray, radius: float, settings: MatchSettings) -> np.ndarray:
    """(K,) bool, which key points of a frame can have a partner at all: the others need no patches.

    positions : (K, 3) of the frame's key points.  places, settings : as for `match_keypoints`.  radius : of the patches, scene units.
    """
    if not settings.guided or not len(places):
        return np.full(len(positions), not settings.guided)
    return cKDTree(places).query(positions)[0] <= settings.reach * radius


def match_keypoints(
    reference: Patches, frame: Patches, places: np.ndarray, rotations: np.ndarray, settings: MatchSettings = MatchSettings()
) -> Matches:
    """The best partner of each reference key point, where there is one below the threshold.

    places : (K, 3) where tracking carries each reference key point in the frame, scene units.
    rotations : (K, 3, 3) how its surroundings turn on the way (column vectors: p' = R p); the first start of every search.

    A match is mutual: no other pair of either key point has a smaller error, so each has one partner at most.
    """
    count = len(reference.vertices)
    for name, value, shape in (("places", places, (count, 3)), ("rotations", rotations, (count, 3, 3))):
        if value.shape != shape:
            raise ValueError(f"{name} must be {shape} to match the reference key points; got {value.shape}")
    if not count or not len(frame.vertices):
        return Matches(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0))
    if settings.guided:
        near = cKDTree(frame.positions).query_ball_point(places, settings.reach * reference.radius, return_sorted=True)
        r = np.repeat(np.arange(count), [len(found) for found in near])
        f = np.array([item for found in near for item in found], dtype=np.int64)
        starts = rotations[r]
    else:
        r, f, starts = _promising(reference, frame, rotations)
    errors, rotations = fit_patches(reference, frame, (r, f), starts, settings.fixed_point)
    if settings.fixed_point:  # parts thinner than the threshold: turned about one point, both sides must still face one way
        facing = np.einsum("nij,nj,ni->n", rotations, reference.normals[r], frame.normals[f]) > 0
        r, f, errors = r[facing], f[facing], errors[facing]
    return _mutual(r, f, errors, settings.threshold)


def _promising(reference: Patches, frame: Patches, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The pairs and starts with the smallest coarse error, REFINED for each reference key point.

    Starts of a pair: no rotation, the predicted one, and the four that lay the principal axes on each other.
    """
    count, candidates = len(reference.vertices), len(frame.vertices)
    turns = np.array([np.diag(signs) for signs in ((1, 1, 1), (-1, -1, 1), (1, -1, -1), (-1, 1, -1))], dtype=float)
    kept = min(REFINED, 6 * candidates)
    rows, columns, starts = np.repeat(np.arange(count), kept), np.empty(count * kept, dtype=np.int64), np.empty((count * kept, 3, 3))
    for r in range(count):
        aligned = frame.axes[:, None] @ turns @ reference.axes[r].T
        plain = np.broadcast_to(np.stack([np.eye(3), rotations[r]]), (candidates, 2, 3, 3))
        trial = np.concatenate([plain, aligned], axis=1)
        errors = _coarse_errors(reference.offsets[r, :COARSE_POINTS], frame.offsets, trial)
        order = np.argsort(errors, axis=None, kind="stable")[:kept]
        part = slice(r * kept, (r + 1) * kept)
        columns[part], starts[part] = order // 6, trial.reshape(-1, 3, 3)[order]
    return rows, columns, starts


def _coarse_errors(points: np.ndarray, targets: np.ndarray, trial: np.ndarray) -> np.ndarray:
    """(K, S) mean squared nearest distances of (n, 3) points turned by (K, S, 3, 3) to (K, m, 3) targets; float32 will do."""
    moved, targets = (points @ trial.transpose(0, 1, 3, 2)).astype(np.float32), targets.astype(np.float32)
    squares = square_distances(moved.reshape(len(trial), -1, 3), targets).min(axis=2)
    return squares.reshape(*trial.shape[:2], -1).mean(axis=2)


def _mutual(r: np.ndarray, f: np.ndarray, errors: np.ndarray, threshold: float) -> Matches:
    """Pairs below the threshold that are the best of all pairs of both their key points; equals go to the lower numbers."""
    best_of_r = _firsts(r, np.lexsort((f, errors, r)))
    best_of_f = _firsts(f, np.lexsort((r, errors, f)))
    chosen = np.intersect1d(best_of_r, best_of_f)
    chosen = chosen[errors[chosen] <= threshold]
    chosen = chosen[np.argsort(r[chosen])]
    return Matches(r[chosen], f[chosen], errors[chosen])


def _firsts(keys: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Of an order sorted by keys, the first entry of each key."""
    return order[np.unique(keys[order], return_index=True)[1]]
