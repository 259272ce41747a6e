"""Global optimization of tracked centers: all frames at once (Dvorak et al., ICCS 2023).

Forward tracking decides frame after frame, and its errors accumulate. Here every frame is pulled by the one before and
the one after, with affinities that know the whole sequence; irregular centers are dropped first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from ..geometry.rotations import rigid_motions
from ..progress import Progress, ignore
from ..settings import choices_of
from ..types import FrozenArrays
from ..variants import check_variant
from . import lloyd
from .affinity import Affinity, near_pairs, updated
from .irregularity import regular_centers
from .ownership import Ownership
from .sequence_energy import SamplesOf, minimized


@dataclass(frozen=True)
class Trajectories:
    """Tracked centers of a sequence.

    positions : (F, C, 3) float64, scene units.  weights : (C, C) symmetric affinities so far.  spacing : s, scene units.
    bodies : (C,) numbers of bodies between which there is no affinity; None for none that are known.
    """

    positions: np.ndarray
    weights: sparse.spmatrix
    spacing: float
    bodies: np.ndarray | None = None

    def of(self, kept: np.ndarray) -> Trajectories:
        """Some of the centers, by index."""
        weights = sparse.csr_matrix(self.weights)[kept][:, kept]
        return replace(self, positions=self.positions[:, kept], weights=weights, bodies=None if self.bodies is None else self.bodies[kept])


@dataclass(frozen=True)
class Optimized(FrozenArrays):
    """positions : (F, C', 3), scene units.  kept : (C',) which of the C centers they are.
    affinity : of the kept centers over the whole sequence.  energies : of the start and after each iteration, in s^2.
    lloyd_energy : (F,) per frame.  arap_energy : (F,) from the frame before, 0 for the first; both in s^2.
    """

    positions: np.ndarray
    kept: np.ndarray
    affinity: Affinity
    energies: np.ndarray
    lloyd_energy: np.ndarray
    arap_energy: np.ndarray


def optimize(tracks: Trajectories, samples_of: SamplesOf, variant: str = "max", progress: Progress = ignore) -> Optimized:
    """One round of global optimization: drop irregular centers, renew the affinity, lower the energy of all frames.

    samples_of : the volume of a frame by its row, read again in every iteration so that memory stays small.
    variant : of the affinity, see `affinity.updated`.
    Deterministic; the energy never rises. Raises ValueError for shapes that do not fit, a spacing that is not positive and an
    unknown variant.
    """
    _check(tracks)
    check_variant("variant", variant, choices_of("affinity"))
    kept = regular_centers(tracks.positions)
    tracks = tracks.of(kept)
    affinity = sequence_affinity(tracks, samples_of, variant)
    state, energies = minimized(tracks.positions, affinity.weights(), samples_of, tracks.spacing, progress)
    affinity = sequence_affinity(replace(tracks, positions=state.positions, weights=affinity.weights()), samples_of, variant)
    return Optimized(state.positions, kept, affinity, energies, state.lloyd_energy, state.arap_energy)


def sequence_affinity(tracks: Trajectories, samples_of: SamplesOf, variant: str) -> Affinity:
    """Affinity over all frames; the weights of the tracks are the neighborhoods whose motions are compared."""
    positions, affinity = tracks.positions, near_pairs(tracks.positions[0], tracks.spacing)
    if tracks.bodies is not None:
        affinity = affinity.within(tracks.bodies)
    for frame in range(1, len(positions)):
        cells = lloyd.cells(positions[frame - 1], Ownership(samples_of(frame - 1)))
        motions = rigid_motions(tracks.weights, positions[frame - 1], positions[frame])
        affinity = updated(affinity, positions[frame], cells, motions, variant)
    return affinity


def _check(tracks: Trajectories) -> None:
    positions, weights, spacing = tracks.positions, tracks.weights, tracks.spacing
    if positions.ndim != 3 or positions.shape[2] != 3 or not positions.size or not np.isfinite(positions).all():
        raise ValueError(f"positions must be (F, C, 3) finite numbers, at least one; got {positions.shape}")
    if weights.shape != (positions.shape[1],) * 2:
        raise ValueError(f"weights must be {(positions.shape[1],) * 2} to match positions; got {weights.shape}")
    if not (np.isfinite(spacing) and spacing > 0):
        raise ValueError(f"spacing must be a positive length; got {spacing}")
