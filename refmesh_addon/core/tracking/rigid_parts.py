"""Parts of tracked bodies that move rigidly through some frames.

Parts grow from seeds: from the neighborhood that moves most rigidly, over all neighbors that its rigid motions carry to their own places,
with the motions fitted anew in each round. What is left gives the next seed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..geometry.rotations import closest_rotations, rigid_motions

TOLERANCE = 0.4  # distance, in s, by which a center may miss the motion of its part: twice the usual error of tracking
ENOUGH = 6  # centers that a part grows from
GROWING = 40  # rounds at most; a part grows by about one s in each
SETTLING = 10  # of these, the last ones, in which it only loses centers


@dataclass(frozen=True)
class PartMotion:
    """x -> rotation x + shift, for each of F frames.  rotations : (F, 3, 3).  shifts : (F, 3) scene units."""

    rotations: np.ndarray
    shifts: np.ndarray

    @classmethod
    def fitted(cls, source: np.ndarray, targets: np.ndarray) -> PartMotion:
        """The best rigid motions of (N, 3) points to (F, N, 3) (Kabsch 1976)."""
        middle, goals = source.mean(axis=0), targets.mean(axis=1)
        rotations = closest_rotations(np.einsum("fni,nj->fij", targets - goals[:, None], source - middle))
        return cls(rotations, goals - rotations @ middle)

    def images(self, points: np.ndarray) -> np.ndarray:
        """(F, N, 3) of (N, 3) points."""
        return np.einsum("fij,nj->fni", self.rotations, points) + self.shifts[:, None]


@dataclass(frozen=True)
class RigidParts:
    """label : (C,) number of the part of each center, -1 where there is none.  motions : of each part, from the first frame on."""

    label: np.ndarray
    motions: tuple[PartMotion, ...]


def rigid_parts(positions: np.ndarray, neighbors: sparse.csr_matrix, spacing: float, least: int) -> RigidParts:
    """The parts that move rigidly through all frames, those that do so best first.

    positions : (F, C, 3) scene units; the motions go from row 0 to the others.  neighbors : (C, C), ones between neighbors and on the
    diagonal.  spacing : s, scene units.  least : number of centers of a part.
    """
    start, frames = positions[0], positions[1:]
    label = np.full(len(start), -1)
    motions: list[PartMotion] = []
    tried = np.zeros(len(start), dtype=bool)
    for seed in np.argsort(_misfit(positions, neighbors), kind="stable"):
        if label[seed] >= 0 or tried[seed]:
            continue
        part = _grown(start, frames, neighbors, neighbors[seed].indices, label < 0, spacing)
        tried[part] = True
        part = _largest_piece(part, neighbors)
        if len(part) >= least:
            label[part] = len(motions)
            motions.append(PartMotion.fitted(start[part], frames[:, part]))
    return RigidParts(label, tuple(motions))


def _misfit(positions: np.ndarray, neighbors: sparse.csr_matrix) -> np.ndarray:
    """(C,) largest distance by which a center misses the motion of its neighborhood."""
    missed = [rigid_motions(neighbors, positions[0], frame).apply(positions[0]) - frame for frame in positions[1:]]
    return np.linalg.norm(missed, axis=2).max(axis=0)


def _grown(
    start: np.ndarray, frames: np.ndarray, neighbors: sparse.csr_matrix, seeds: np.ndarray, free: np.ndarray, spacing: float
) -> np.ndarray:
    """Indices of the free centers that belong to the part of some seeds; those of the seeds alone where no part grows from them."""
    part = np.zeros(len(start), dtype=bool)
    part[seeds] = free[seeds]
    for round_ in range(GROWING):
        if part.sum() < ENOUGH:
            break
        missed = np.linalg.norm(PartMotion.fitted(start[part], frames[:, part]).images(start) - frames, axis=2).max(axis=0)
        reached = neighbors @ part > 0 if round_ < GROWING - SETTLING else part
        grown = free & reached & (missed < TOLERANCE * spacing)
        if (grown == part).all():
            break
        part = grown
    return np.flatnonzero(part)


def _largest_piece(part: np.ndarray, neighbors: sparse.csr_matrix) -> np.ndarray:
    if not len(part):
        return part
    _, piece = connected_components(neighbors[part][:, part], directed=False)
    return part[piece == np.bincount(piece).argmax()]
