"""Reference centers: positions in which centers that ever part are apart (paper, section "Extracting Reference Centers").

The largest distance of each pair over the group is embedded in space by SMACOF (De Leeuw 1977), started from the frame
whose own centers fit those distances best: that start is deterministic and ends lower than random ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import pdist, squareform

from .progress import Progress, ignore
from .rotations import closest_rotations
from .types import _FrozenArrays

STRESS_STOP = 1e-5  # relative drop of stress per step at which SMACOF stops
MOST_STEPS = 300


@dataclass(frozen=True)
class ReferenceCenters(_FrozenArrays):
    """positions : (C, 3) scene units, rigidly aligned with the anchor frame's centers.
    anchor : index within the group of the frame that fits the largest distances best (the paper's R-frame).
    stress : the paper's sigma(X), equation (3).  frame_stress : (F,) the same of each frame's own centers.
    """

    positions: np.ndarray
    anchor: int
    stress: float
    frame_stress: np.ndarray


def reference_centers(positions: np.ndarray, progress: Progress = ignore) -> ReferenceCenters:
    """Reference centers of a group.

    positions : (F, C, 3) float64, scene units; row f is the centers in frame f of the group.
    Memory: a handful of (C, C) float64 matrices. Raises ValueError for another shape.
    """
    if positions.ndim != 3 or positions.shape[2] != 3 or not len(positions):
        raise ValueError(f"positions must be (F, C, 3); got {positions.shape}")
    wanted = largest_distances(positions)
    frame_stress = np.array([stress(centers, wanted) for centers in positions])
    anchor = int(np.argmin(frame_stress))
    embedded = smacof(wanted, positions[anchor], progress)
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


def smacof(wanted: np.ndarray, start: np.ndarray, progress: Progress = ignore) -> np.ndarray:
    """(C, 3) points whose distances approach (C, C) `wanted`, by Guttman steps; stress never rises."""
    points = start - start.mean(axis=0)
    last = np.inf
    for step in range(MOST_STEPS):
        distance = squareform(pdist(points))
        missed = wanted - distance
        now = float(np.sqrt(np.einsum("ij,ij->", missed, missed)))
        if now >= last * (1 - STRESS_STOP):
            break
        last = now
        ratio = np.divide(wanted, distance, out=np.zeros_like(wanted), where=distance > 0)
        points = (ratio.sum(axis=1)[:, None] * points - ratio @ points) / len(points)
        progress((step + 1) / MOST_STEPS)
    progress(1.0)
    return points


def rigidly_aligned(points: np.ndarray, target: np.ndarray) -> np.ndarray:
    """(C, 3) points rotated and moved, never reflected by the alignment itself, to fit `target` best (Kabsch 1976)."""
    middle, goal = points.mean(axis=0), target.mean(axis=0)
    rotation = closest_rotations(((target - goal).T @ (points - middle))[None])[0]
    return (points - middle) @ rotation.T + goal
