"""Reference centers: positions in which centers that ever separate are apart (paper, section "Extracting Reference Centers").

The largest distance of each pair over the group is embedded in space by SMACOF, started from the frame whose own centers
fit those distances best: that start is deterministic and ends lower than random ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import pdist, squareform

from ..geometry.rotations import closest_rotations
from ..progress import Progress, ignore
from ..settings import choices_of
from ..types import FrozenArrays
from ..variants import check_variant
from .smacof import near_weights, pooled_stress, smacof

# An anchor frame may have this many times the least stress if less speaks against it otherwise. The embedding ends nearly the same from
# any frame: of a dancer with open soles, one of 1.7 times the least stress gave a mesh 2 % nearer to the frames, stretched a tenth as much.
STRESS_FOR_PENALTY = 2.0
SAME_PENALTY = 1.05  # ratio up to which penalties count as equal


@dataclass(frozen=True)
class ReferenceCenters(FrozenArrays):
    """positions : (C, 3) scene units, rigidly aligned with the anchor frame's centers.
    anchor : index within the group of the frame that fits the largest distances best (the paper's R-frame), or of one nearly as good
    against which less speaks otherwise.
    stress : the paper's sigma(X), equation (3).  frame_stress : (F,) the same of each frame's own centers.
    """

    positions: np.ndarray
    anchor: int
    stress: float
    frame_stress: np.ndarray


def reference_centers(
    positions: np.ndarray,
    progress: Progress = ignore,
    counted: str = "plain",
    bodies: np.ndarray | None = None,
    penalty: np.ndarray | None = None,
) -> ReferenceCenters:
    """Reference centers of a group.

    positions : (F, C, 3) float64, scene units; row f is the centers in frame f of the group.
    counted : "plain", all pairs equally, or "near", pairs by the inverse square of their largest distance (Sammon 1969 has the
    inverse). The anchor and the stresses returned are those of plain stress either way.
    bodies : (C,) number of the body of each center; distances between bodies then count for nothing, and each body lies where it does
    in the anchor frame. None for one body.
    penalty : (F,) what speaks against each frame as the anchor frame, such as ragged rims of holes; None for nothing.
    Memory: five (C, C) float64 matrices at a time, 640 MB for 4000 centers; eight, 1 GB, for "near".
    Raises ValueError for another shape or an unknown way of counting.

    >>> closed, open = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0.0, 0, 0], [1, 0, 0], [0, 3, 0]]
    >>> reference_centers(np.array([closed, open])).anchor
    1
    """
    check_variant("counted", counted, choices_of("stress"))
    if positions.ndim != 3 or positions.shape[2] != 3 or not len(positions):
        raise ValueError(f"positions must be (F, C, 3); got {positions.shape}")
    members = [np.arange(positions.shape[1])] if bodies is None else [np.flatnonzero(bodies == body) for body in np.unique(bodies)]
    distances = [largest_distances(positions[:, own]) for own in members]
    pooled = lambda centers: pooled_stress([centers[own] for own in members], distances)
    frame_stress = np.array([pooled(centers) for centers in positions])
    anchor = _anchor(frame_stress, penalty)
    aligned = np.empty(positions.shape[1:])
    for own, largest in zip(members, distances, strict=True):
        start = positions[anchor, own]
        embedded = smacof(largest, start, progress, near_weights(largest) if counted == "near" else None)
        aligned[own] = rigidly_aligned(embedded, start)
    return ReferenceCenters(aligned, anchor, pooled(aligned), frame_stress)


def _anchor(stress: np.ndarray, penalty: np.ndarray | None) -> int:
    """The frame of least stress among those of about the least penalty: the anchor frame's holes are closed in its own way, for example.

    stress, penalty : (F,) of the frames, None for no penalty.
    """
    if penalty is None:
        return int(np.argmin(stress))
    fits = stress <= STRESS_FOR_PENALTY * stress.min()
    best = fits & (penalty <= SAME_PENALTY * penalty[fits].min())
    return int(np.argmin(np.where(best, stress, np.inf)))


def largest_distances(positions: np.ndarray) -> np.ndarray:
    """(C, C) largest distance of each pair of centers over the frames of (F, C, 3) positions; paper, equation (1)."""
    largest = pdist(positions[0])
    for centers in positions[1:]:
        np.maximum(largest, pdist(centers), out=largest)
    return squareform(largest)


def rigidly_aligned(points: np.ndarray, target: np.ndarray) -> np.ndarray:
    """(C, 3) points rotated and moved, never mirrored, to fit (C, 3) `target` best (Kabsch 1976)."""
    middle, goal = points.mean(axis=0), target.mean(axis=0)
    rotation = closest_rotations(((target - goal).T @ (points - middle))[None])[0]
    return (points - middle) @ rotation.T + goal
