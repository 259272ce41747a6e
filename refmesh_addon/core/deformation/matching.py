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

COARSE_POINTS = 16  # of each reference patch, when many starts are tried
REFINED = 8  # pairs and starts refined for each reference key point of an unlimited search
# Half turns about the principal axes: with them, axes that have no direction of their own are laid on each other in all four ways.
AXIS_FLIPS = np.array([np.diag(signs) for signs in ((1, 1, 1), (-1, -1, 1), (1, -1, -1), (-1, 1, -1))], dtype=float)


@dataclass(frozen=True)
class MatchSettings:
    """Radii and errors are multiples of the patch radius.

    guided : candidates are the key points near the predicted place; otherwise all key points of the frame, as in the paper.
    reach : how far from the predicted place a candidate may lie.
    threshold : largest error of a match (sigma_th in the paper).
    fixed_point : key points stay on each other; False is the earlier method, the best rigid fit of the patches.
    any_rotation : an unlimited search also starts from the four rotations that lay the principal axes of the patches on each other,
    and so finds partners after any turn; otherwise from no rotation and from the predicted one.
    """

    guided: bool = True
    reach: float = 0.25
    threshold: float = 0.4
    fixed_point: bool = True
    any_rotation: bool = True


# The paper's search: among all key points of the frame. It minimises over three angles from a start that it does not name, and removes
# pairs above a sigma_th that it does not give. All corners of a box fit each other after some turn, so the start counts: no rotation, as
# a minimisation over angles begins, or the turn of the tracked centers. Nine of ten pairs of a dancer are right up to an error of 0.35,
# half of them above; on a ball and a box hardly any pair lies between 0.325 and 0.5, and all above are wrong.
PUBLISHED_SEARCH = MatchSettings(guided=False, threshold=0.35, any_rotation=False)


@dataclass(frozen=True)
class Matches(FrozenArrays):
    """reference, frame : (M,) int64, positions in the lists of key points.  errors : (M,) share of the patch radius."""

    reference: np.ndarray
    frame: np.ndarray
    errors: np.ndarray


@dataclass(frozen=True)
class _Candidates(FrozenArrays):
    """Pairs that may match: key points (N,) of the reference and of the frame, and the rotation (N, 3, 3) to begin with."""

    reference: np.ndarray
    frame: np.ndarray
    rotations: np.ndarray


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
    _check_predictions(len(reference.vertices), places, rotations)
    if not len(reference.vertices) or not len(frame.vertices):
        return Matches(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0))
    if settings.guided:
        candidates = _nearby(reference, frame, places, rotations, settings.reach)
    else:
        candidates = _promising(reference, frame, rotations, settings.any_rotation)
    r, f = candidates.reference, candidates.frame
    errors, rotations = fit_patches(reference, frame, (r, f), candidates.rotations, settings.fixed_point)
    if settings.fixed_point:  # parts thinner than the threshold: turned about one point, both sides must still face one way
        facing = np.einsum("nij,nj,ni->n", rotations, reference.normals[r], frame.normals[f]) > 0
        r, f, errors = r[facing], f[facing], errors[facing]
    return _mutual(r, f, errors, settings.threshold)


def _check_predictions(count: int, places: np.ndarray, rotations: np.ndarray) -> None:
    for name, value, shape in (("places", places, (count, 3)), ("rotations", rotations, (count, 3, 3))):
        if value.shape != shape:
            raise ValueError(f"{name} must be {shape} to match the reference key points; got {value.shape}")


def _nearby(reference: Patches, frame: Patches, places: np.ndarray, rotations: np.ndarray, reach: float) -> _Candidates:
    """Key points within reach of the predicted places, from the predicted rotations."""
    near = cKDTree(frame.positions).query_ball_point(places, reach * reference.radius, return_sorted=True)
    rows = np.repeat(np.arange(len(places)), [len(columns) for columns in near])
    return _Candidates(rows, np.array([column for columns in near for column in columns], dtype=np.int64), rotations[rows])


def _promising(reference: Patches, frame: Patches, rotations: np.ndarray, any_rotation: bool) -> _Candidates:
    """The pairs and rotations with the smallest coarse errors, REFINED for each reference key point."""
    rows, columns, starts = [], [], []
    for r, rotation in enumerate(rotations):
        trial = _trial_rotations(reference.axes[r], frame.axes, rotation, any_rotation)
        errors = _coarse_errors(reference.offsets[r, :COARSE_POINTS], frame.offsets, trial)
        order = np.argsort(errors, axis=None, kind="stable")[:REFINED]
        rows.append(np.full(len(order), r))
        columns.append(order // trial.shape[1])
        starts.append(trial.reshape(-1, 3, 3)[order])
    return _Candidates(np.concatenate(rows), np.concatenate(columns), np.concatenate(starts))


def _trial_rotations(axes: np.ndarray, frame_axes: np.ndarray, rotation: np.ndarray, any_rotation: bool) -> np.ndarray:
    """(K, S, 3, 3) starts of one reference key point with each of K candidates: no rotation, the predicted one, the axes on each other."""
    predicted = np.broadcast_to(np.stack([np.eye(3), rotation]), (len(frame_axes), 2, 3, 3))
    if not any_rotation:
        return predicted
    return np.concatenate([predicted, frame_axes[:, None] @ AXIS_FLIPS @ axes.T], axis=1)


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
