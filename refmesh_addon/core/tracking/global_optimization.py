"""Global optimisation of tracked centers: all frames at once (Dvorak et al., ICCS 2023).

Forward tracking decides frame after frame, and what it misses piles up. Here every frame is pulled by the one before and
the one after, with affinities that know the whole sequence; centers that keep nobody company are dropped first.

The published steps along the plain gradient are replaced by ones that reach a lower energy sooner: with the owner of
every sample held, Lloyd's energy is a quadratic that touches the true one from above (so going down in it never goes up
in truth), and needs nothing of a frame but masses and centroids. The volume is asked for once per iteration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse

from ..geometry.rotations import rigid_motions
from ..progress import Progress, ignore
from ..settings import choices_of
from ..types import FrozenArrays
from ..variants import check_variant
from . import lloyd
from .affinity import Affinity, near_pairs, updated
from .ownership import Ownership
from .volume import Volume, VolumeSamples

# Weight of the rigidity energy against Lloyd's, forward and backward together; more than forward tracking's, because all
# frames can give way here. Ten keeps centers less close to the material of a turning or bending body whose motion is known.
RIGIDITY = 40.0
ITERATIONS = 30  # published, each with one look at the volumes
INNER_STEPS = 10  # steps with the owners held; with three or five the same 30 iterations end at a higher energy
MOMENTUM = 0.9  # share of the last change that is made again; given up for an iteration where the energy would rise
ENOUGH = 1e-6  # relative drop of the energy in one iteration at which it has settled
DROPPED_SHARE = 0.005  # most centers to drop at a time, 5 of 1000; published 5 to 10
IRREGULAR = 1.5  # times the median distance to the nearest companion: an even spread alone stays below 1.3
ROWS_AT_A_TIME = 512  # of the (C, C) table of distances between trajectories
SAMPLES_PER_CENTER = 60  # with some 15 centers settle into the blocks: lower energy there, higher on the finest level
LEAST_CURVATURE = 1e-3  # of a center that owns nothing and has no neighbours: it stays where it is

SamplesOf = Callable[[int], VolumeSamples]


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


def coarse_samples(volume: Volume, count: int) -> VolumeSamples:
    """About SAMPLES_PER_CENTER blocks of a volume for each of `count` centers, with exact masses and centroids.

    The volume's own levels are steps of eight and more apart, and here every sample counts in every iteration.
    """
    finest = volume.finest
    edge = (volume.size / (SAMPLES_PER_CENTER * count)) ** (1 / 3)
    if edge < 1.5 * finest.spacing:
        return finest
    block = np.floor((finest.positions - finest.positions.min(axis=0)) / edge).astype(np.int64)
    _, block = np.unique(np.ravel_multi_index(block.T, block.max(axis=0) + 1), return_inverse=True)
    masses = np.bincount(block, finest.masses)
    moments = np.stack([np.bincount(block, finest.masses * axis) for axis in finest.positions.T], axis=1)
    return VolumeSamples(moments / masses[:, None], masses, edge)


def optimize(
    positions: np.ndarray,
    weights: sparse.spmatrix,
    samples_of: SamplesOf,
    spacing: float,
    variant: str = "max",
    progress: Progress = ignore,
) -> Optimized:
    """One round of global optimisation: drop irregular centers, renew the affinity, lower the energy of all frames.

    positions : (F, C, 3) float64 tracked centers, scene units.  weights : (C, C) symmetric affinities so far.
    samples_of : the volume of a frame by its row, asked for again in every iteration so that memory stays small.
    spacing : s, scene units.  variant : of the affinity, see `affinity.updated`.
    Deterministic; the energy never rises. Raises ValueError for shapes that do not fit, a spacing that is not positive and an
    unknown variant.
    """
    check_variant("variant", variant, choices_of("affinity"))
    if positions.ndim != 3 or positions.shape[2] != 3 or not positions.size or not np.isfinite(positions).all():
        raise ValueError(f"positions must be (F, C, 3) finite numbers, at least one; got {positions.shape}")
    if weights.shape != (positions.shape[1],) * 2:
        raise ValueError(f"weights must be {(positions.shape[1],) * 2} to match positions; got {weights.shape}")
    if not (np.isfinite(spacing) and spacing > 0):
        raise ValueError(f"spacing must be a positive length; got {spacing}")
    kept = regular(positions)
    positions = positions[:, kept]
    affinity = sequence_affinity(positions, sparse.csr_matrix(weights)[kept][:, kept], samples_of, spacing, variant)
    found, energies = minimised(positions, affinity.weights(), samples_of, spacing, progress)
    affinity = sequence_affinity(found.positions, affinity.weights(), samples_of, spacing, variant)
    return Optimized(found.positions, kept, affinity, energies, found.lloyd_energy, found.arap_energy)


def regular(positions: np.ndarray) -> np.ndarray:
    """Indices (C',), in order, of the trajectories to keep: all but the few worst that stand out as irregular."""
    distance = np.sqrt(irregularity(positions))
    most = int(np.ceil(DROPPED_SHARE * len(distance)))
    worst = np.argsort(-distance, kind="stable")[:most]
    return np.setdiff1d(np.arange(len(distance)), worst[distance[worst] > IRREGULAR * np.median(distance)])


def irregularity(positions: np.ndarray) -> np.ndarray:
    """(C,) mean over the frames of the squared distance to the nearest other trajectory, units squared; 0 for a single one."""
    frames, count, _ = positions.shape
    if count < 2:
        return np.zeros(count)
    centered = positions - positions.mean(axis=1, keepdims=True)  # far coordinates would cost digits
    trajectories = centered.transpose(1, 0, 2).reshape(count, -1)
    length = np.einsum("ij,ij->i", trajectories, trajectories)
    nearest = np.empty(count)
    for start in range(0, count, ROWS_AT_A_TIME):
        rows = np.arange(start, min(start + ROWS_AT_A_TIME, count))
        squared = length[rows, None] + length - 2 * trajectories[rows] @ trajectories.T
        squared[rows - start, rows] = np.inf
        nearest[rows] = squared.min(axis=1)
    return np.maximum(nearest, 0) / frames


def sequence_affinity(positions: np.ndarray, weights: sparse.spmatrix, samples_of: SamplesOf, spacing: float, variant: str) -> Affinity:
    """Affinity over all frames of (F, C, 3) positions; `weights` (C, C) are the neighbourhoods whose motions are compared."""
    affinity = near_pairs(positions[0], spacing)
    for frame in range(1, len(positions)):
        cells = lloyd.cells(positions[frame - 1], Ownership(samples_of(frame - 1)))
        motions = rigid_motions(weights, positions[frame - 1], positions[frame])
        affinity = updated(affinity, positions[frame], cells, motions, variant)
    return affinity


@dataclass(frozen=True)
class State(FrozenArrays):
    """Positions (F, C, 3) with the parts of their energy.

    masses : (F, C) of the cells, as multiples of the frame's mean.  centroids : (F, C, 3) of the cells.
    lloyd_energy, arap_energy : (F,) in s^2; the latter from the frame before.
    """

    positions: np.ndarray
    masses: np.ndarray
    centroids: np.ndarray
    lloyd_energy: np.ndarray
    arap_energy: np.ndarray

    @property
    def energy(self) -> float:
        """What is minimised: the sum over all frames, in s^2."""
        return float(self.lloyd_energy.sum() + RIGIDITY * self.arap_energy.sum())


def minimised(positions: np.ndarray, weights: sparse.spmatrix, samples_of: SamplesOf, spacing: float, progress: Progress = ignore):
    """The state of lower energy found from (F, C, 3) positions, and the energies (I + 1,) on the way, in s^2."""
    misfit = Misfit(weights)
    here, change = _state(positions, misfit, samples_of, spacing), np.zeros(positions.shape)
    energies = [here.energy]
    for iteration in range(ITERATIONS):
        lower = _descended(here, misfit, partial(progress, iteration / ITERATIONS))
        for momentum in (MOMENTUM, 0.0):
            there = _state(lower + momentum * change, misfit, samples_of, spacing)
            if there.energy < here.energy:
                break
        else:
            break
        change, here = there.positions - here.positions, there
        energies.append(here.energy)
        if energies[-1] > (1 - ENOUGH) * energies[-2]:
            break
    progress(1.0)
    return here, np.array(energies)


def _state(positions: np.ndarray, misfit: Misfit, samples_of: SamplesOf, spacing: float) -> State:
    cells = [lloyd.cells(centers, Ownership(samples_of(frame))) for frame, centers in enumerate(positions)]
    masses = np.stack([cell.masses / cell.masses.mean() for cell in cells])
    arap = [0.0, *(misfit(before, after)[0] for before, after in zip(positions, positions[1:], strict=False))]
    scale = spacing**2
    return State(
        positions,
        masses,
        np.stack([cell.centroids for cell in cells]),
        np.array([cell.energy for cell in cells]) / scale,
        np.array(arap) / scale,
    )


def _descended(state: State, misfit: Misfit, pulse: Callable[[], None]) -> np.ndarray:
    """Positions (F, C, 3) after steps down the energy whose cells keep their masses and centroids."""
    positions, step = state.positions, np.zeros(state.positions.shape)
    curvature = state.masses.copy()
    curvature[1:] += RIGIDITY * misfit.curvature
    curvature[:-1] += RIGIDITY * misfit.curvature
    curvature = np.maximum(curvature, LEAST_CURVATURE)[..., None]
    for taken in range(INNER_STEPS):
        pulse()
        gradient = state.masses[..., None] * (positions - state.centroids)
        for frame in range(1, len(positions)):
            _, before, after = misfit(positions[frame - 1], positions[frame])
            gradient[frame - 1] += RIGIDITY * before
            gradient[frame] += RIGIDITY * after
        step = taken / (taken + 3) * step - gradient / curvature  # Nesterov's growing momentum
        positions = positions + step
    return positions


class Misfit:
    """How far neighbourhoods are from moving rigidly between two frames.

    The energy is the mean over neighbourhoods i of the mean over their centers j, by affinity, of |A_i x_j - y_j|^2,
    A_i the best rigid motion from x to y. Missed forward (A x - y) or backward (x - A^-1 y), the distance is the same,
    so one term stands for the published two.
    """

    def __init__(self, weights: sparse.spmatrix):
        """weights : (C, C) affinities, not negative, with ones on the diagonal."""
        self._share = sparse.csr_matrix(sparse.diags(1 / np.asarray(weights.sum(axis=1)).ravel()) @ weights)
        self._gathered = sparse.csr_matrix(self._share.T)
        self.curvature = np.asarray(self._share.sum(axis=0)).ravel()  # (C,) of the energy along each center, as below

    def __call__(self, before: np.ndarray, after: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Energy, units squared, and C/2 times its gradients (C, 3) by the positions (C, 3) before and after.

        The motions are at their optimum, so the gradients are those with the motions held. Summed over i first,
        |A_i x_j - y_j|^2 needs only the sums of the rotations R_i and shifts t_i about each center j.
        """
        before, after = before - before.mean(axis=0), after - after.mean(axis=0)
        motions = rigid_motions(self._share, before, after)
        turns = motions.rotations
        shifts = motions.targets - np.einsum("nij,nj->ni", turns, motions.sources)
        back = np.einsum("nji,nj->ni", turns, shifts)
        squares = np.einsum("ni,ni->n", shifts, shifts)
        sums = self._gathered @ np.column_stack([turns.reshape(-1, 9), shifts, back, squares])
        turn, shift, back, square = sums[:, :9].reshape(-1, 3, 3), sums[:, 9:12], sums[:, 12:15], sums[:, 15]
        by_after = self.curvature[:, None] * after - np.einsum("nij,nj->ni", turn, before) - shift
        by_before = self.curvature[:, None] * before - np.einsum("nji,nj->ni", turn, after) + back
        energy = np.sum(after * (by_after - shift)) + np.sum(before * (by_before + back)) + square.sum()
        return max(float(energy) / len(before), 0.0), by_before, by_after
