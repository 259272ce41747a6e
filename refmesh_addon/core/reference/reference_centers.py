"""Reference centers: positions in which centers that ever part are apart (paper, section "Extracting Reference Centers").

The largest distance of each pair over the group is embedded in space by SMACOF (De Leeuw 1977), started from the frame
whose own centers fit those distances best: that start is deterministic and ends lower than random ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import pdist, squareform

from ..geometry.rotations import closest_rotations
from ..progress import Progress, ignore
from ..settings import choices_of
from ..types import FrozenArrays
from ..variants import check_variant

STRESS_STOP = 1e-5  # relative drop of stress per step at which SMACOF stops
MAX_STEPS = 300
LEAST_SHARE = 0.01  # of the median distance; nearer pairs weigh no more, or two centers in one place would rule


@dataclass(frozen=True)
class ReferenceCenters(FrozenArrays):
    """positions : (C, 3) scene units, rigidly aligned with the anchor frame's centers.
    anchor : index within the group of the frame that fits the largest distances best (the paper's R-frame).
    stress : the paper's sigma(X), equation (3).  frame_stress : (F,) the same of each frame's own centers.
    """

    positions: np.ndarray
    anchor: int
    stress: float
    frame_stress: np.ndarray


def reference_centers(positions: np.ndarray, progress: Progress = ignore, counted: str = "plain") -> ReferenceCenters:
    """Reference centers of a group.

    positions : (F, C, 3) float64, scene units; row f is the centers in frame f of the group.
    counted : "plain", all pairs alike, or "near", pairs by the inverse square of their largest distance (Sammon 1969 has the
    inverse). The anchor and the stresses given back are judged by plain stress either way.
    Memory: five (C, C) float64 matrices at a time, 640 MB for 4000 centers; eight, 1 GB, for "near".
    Raises ValueError for another shape or an unknown way of counting.
    """
    check_variant("counted", counted, choices_of("stress"))
    if positions.ndim != 3 or positions.shape[2] != 3 or not len(positions):
        raise ValueError(f"positions must be (F, C, 3); got {positions.shape}")
    wanted = largest_distances(positions)
    frame_stress = np.array([stress(centers, wanted) for centers in positions])
    anchor = int(np.argmin(frame_stress))
    embedded = smacof(wanted, positions[anchor], progress, near_weights(wanted) if counted == "near" else None)
    aligned = rigidly_aligned(embedded, positions[anchor])
    return ReferenceCenters(aligned, anchor, stress(aligned, wanted), frame_stress)


def largest_distances(positions: np.ndarray) -> np.ndarray:
    """(C, C) largest distance of each pair of centers over the frames of (F, C, 3) positions; paper, equation (1)."""
    largest = pdist(positions[0])
    for centers in positions[1:]:
        np.maximum(largest, pdist(centers), out=largest)
    return squareform(largest)


def stress(points: np.ndarray, wanted: np.ndarray) -> float:
    """The paper's equation (3): share of the wanted (C, C) distances that (C, 3) points miss; 0 for a perfect fit."""
    total = np.einsum("ij,ij->", wanted, wanted)
    missed = wanted - squareform(pdist(points))
    return float(np.sqrt(np.einsum("ij,ij->", missed, missed) / total)) if total > 0 else 0.0


def near_weights(wanted: np.ndarray) -> np.ndarray:
    """(C, C) weights of pairs by the inverse square of their wanted distance; zero on the diagonal, mean 1."""
    least = LEAST_SHARE * float(np.median(wanted)) or 1.0
    weights = np.maximum(wanted, least) ** -2.0
    np.fill_diagonal(weights, 0.0)
    return weights / weights.mean()


def smacof(wanted: np.ndarray, start: np.ndarray, progress: Progress = ignore, weights: np.ndarray | None = None) -> np.ndarray:
    """(C, 3) points whose distances approach (C, C) `wanted`, by Guttman steps; the weighted stress never rises.

    weights : (C, C) symmetric, positive off the diagonal; None counts all pairs alike.
    """
    points = start - start.mean(axis=0)
    solve = _guttman(len(points), weights)
    last = np.inf
    for step in range(MAX_STEPS):
        distance = squareform(pdist(points))
        missed = wanted - distance
        now = _root_sum(missed, weights)
        if now >= last * (1 - STRESS_STOP):
            break
        last = now
        ratio = np.divide(wanted, distance, out=np.zeros_like(wanted), where=distance > 0)
        if weights is not None:
            ratio *= weights
        points = solve(ratio.sum(axis=1)[:, None] * points - ratio @ points)
        progress((step + 1) / MAX_STEPS)
    progress(1.0)
    return points


def _root_sum(missed: np.ndarray, weights: np.ndarray | None) -> float:
    return float(np.sqrt(np.einsum("ij,ij->", missed, missed) if weights is None else np.einsum("ij,ij,ij->", weights, missed, missed)))


def _guttman(count: int, weights: np.ndarray | None) -> Callable[[np.ndarray], np.ndarray]:
    """The inverse of the weights' Laplacian on vectors that sum to zero."""
    if weights is None:
        return lambda right: right / count
    factor = cho_factor(np.diag(weights.sum(axis=1)) - weights + 1.0 / count)
    return lambda right: cho_solve(factor, right)


def rigidly_aligned(points: np.ndarray, target: np.ndarray) -> np.ndarray:
    """(C, 3) points rotated and moved, never reflected by the alignment itself, to fit `target` best (Kabsch 1976)."""
    middle, goal = points.mean(axis=0), target.mean(axis=0)
    rotation = closest_rotations(((target - goal).T @ (points - middle))[None])[0]
    return (points - middle) @ rotation.T + goal
