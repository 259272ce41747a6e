"""Affinity of two centers: high where they have been near each other and moved alike in every frame so far.

Source: Dvorak et al. 2022 (affinity over time with a falloff) and Dvorak et al. 2023 (maximum over frames).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..geometry.rotations import RigidMotions, rigid_motions
from ..geometry.vectors import row_dot
from ..settings import choices_of
from ..types import FrozenArrays
from ..variants import check_variant
from .lloyd import Cells

# Distances at which an affinity has fallen to one half, in center spacings.
SEPARATION_HALF = 1.75
DISAGREEMENT_HALF = 0.35
MIN_AFFINITY = 1e-2  # weaker ones are dropped; those down to the published 1e-3 nearly double the pairs and change next to nothing
REACH = SEPARATION_HALF * np.sqrt(np.log2(1 / MIN_AFFINITY))  # separation at which an affinity falls below MIN_AFFINITY
FADE = 0.05  # published falloff of the IIR variant


@dataclass(frozen=True)
class Affinity(FrozenArrays):
    """Affinities of the pairs of centers that are near each other.

    first, second : (N,) int32 centers of each pair, first < second.
    separation : (N,) largest squared distance so far, in s^2.
    agreement : (N,) in [0, 1], how alike the two have moved so far; 0 for pairs on two sides of a gap.
    centers : C.  spacing : s, scene units.
    """

    first: Annotated[np.ndarray, "(N) int32"]
    second: Annotated[np.ndarray, "(N) int32"]
    separation: Annotated[np.ndarray, "(N) float64"]
    agreement: Annotated[np.ndarray, "(N) float64"]
    centers: int
    spacing: float

    def values(self) -> np.ndarray:
        """(N,) affinity of each pair, from 0 to 1."""
        return 0.5 ** (self.separation / SEPARATION_HALF**2) * self.agreement

    def within(self, bodies: np.ndarray) -> Affinity:
        """The same without pairs of different bodies.  bodies : (C,) numbers."""
        kept = bodies[self.first] == bodies[self.second]
        pairs = {name: getattr(self, name)[kept] for name in ("first", "second", "separation", "agreement")}
        return replace(self, **pairs)

    def weights(self) -> sparse.csr_matrix:
        """(C, C) symmetric affinities of at least MIN_AFFINITY, with ones on the diagonal."""
        value = self.values()
        kept = value >= MIN_AFFINITY
        first, second, value = self.first[kept], self.second[kept], value[kept]
        own = np.arange(self.centers)
        rows, columns = np.concatenate([first, second, own]), np.concatenate([second, first, own])
        return sparse.csr_matrix((np.concatenate([value, value, np.ones(self.centers)]), (rows, columns)), (self.centers,) * 2)


def near_pairs(centers: np.ndarray, spacing: float) -> Affinity:
    """The affinity of (C, 3) centers known in one frame only: all pairs within REACH, no motion yet."""
    pairs = cKDTree(centers).query_pairs(REACH * spacing, output_type="ndarray")
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    first, second = pairs[:, 0].astype(np.int32), pairs[:, 1].astype(np.int32)
    separation = _squared_distance(centers, first, second) / spacing**2
    return Affinity(first, second, separation, np.ones(len(first)), len(centers), spacing)


def updated(affinity: Affinity, centers: np.ndarray, cells: Cells, motions: RigidMotions, variant: str = "max") -> Affinity:
    """The affinity after one more frame.

    centers : (C, 3) in the new frame.  cells : of the frame before.  motions : of each center from there to the new
    frame.  variant : "max", by the largest disagreement so far, or "iir", in which old disagreement fades by FADE a frame.
    Raises ValueError for another variant.
    """
    check_variant("variant", variant, choices_of("affinity"))
    separation = np.maximum(affinity.separation, _squared_distance(centers, affinity.first, affinity.second) / affinity.spacing**2)
    now = 0.5 ** (disagreement(affinity, cells, motions) / DISAGREEMENT_HALF**2)
    agreement = np.minimum(affinity.agreement, now) if variant == "max" else (1 - FADE) * affinity.agreement + FADE * now
    return replace(affinity, separation=separation, agreement=agreement)


def group_affinity(positions: np.ndarray, anchor: int, weights: sparse.spmatrix, spacing: float) -> Affinity:
    """Affinity within a group of frames, by the motion of each frame as a whole to the anchor frame.

    positions : (F, C, 3) centers in the frames of the group.  anchor : row of the anchor frame.
    weights : (C, C) affinities of the tracking, the neighborhoods whose rigid motions are compared.
    Cells are approximated by cubes of side s about their centers: accurate enough for their small part in the result.
    """
    affinity = near_pairs(positions[anchor], spacing)
    cube = np.broadcast_to(np.eye(3) * spacing**2 / 12, (positions.shape[1], 3, 3))
    for frame in np.delete(np.arange(len(positions)), anchor):
        cells = Cells(np.ones(positions.shape[1]), positions[frame], cube, 0.0)
        motions = rigid_motions(weights, positions[frame], positions[anchor])
        affinity = updated(affinity, positions[frame], cells, motions)
    return affinity


def disagreement(affinity: Affinity, cells: Cells, motions: RigidMotions) -> np.ndarray:
    """(N,) mean squared distance, in s^2, between the images of a pair's cells under the motions of the one and the other.

    For motions A_i, A_j and a cell with centroid m and second moment S this mean is |A_i m - A_j m|^2 + tr(D S D^T),
    D the difference of the two rotations; the pair's value is the mean over its two cells.
    """
    i, j = affinity.first, affinity.second
    offset = motions.targets - np.einsum("nij,nj->ni", motions.rotations, motions.sources)
    turn, shift = motions.rotations[i] - motions.rotations[j], offset[i] - offset[j]
    total = np.zeros(len(i))
    for cell in (i, j):
        distance = np.einsum("nij,nj->ni", turn, cells.centroids[cell]) + shift
        total += row_dot(distance, distance) + np.einsum("nij,nij->n", turn @ cells.second[cell], turn)
    return total / (2 * affinity.spacing**2)


def _squared_distance(centers: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    difference = centers[first] - centers[second]
    return row_dot(difference, difference)
