"""The energy of the centers of a whole sequence, and its descent (Dvorak et al., ICCS 2023).

The published steps along the plain gradient are replaced by ones that reach a lower energy sooner: with the owner of
every sample held, Lloyd's energy is a quadratic that touches the true one from above (so going down in it never goes up
in truth), and needs nothing of a frame but masses and centroids. The volume is read once per iteration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse

from ..progress import Progress, ignore
from ..types import FrozenArrays
from . import lloyd
from .ownership import Ownership
from .rigid_misfit import RigidMisfit
from .volume import VolumeSamples

# Weight of the rigidity energy against Lloyd's, forward and backward together; more than forward tracking's, because all
# frames can give way here. Ten keeps centers less close to the material of a turning or bending body whose motion is known.
RIGIDITY = 40.0
ITERATIONS = 30  # published, each with one look at the volumes
INNER_STEPS = 10  # steps with the owners held; with three or five the same 30 iterations end at a higher energy
MOMENTUM = 0.9  # share of the last change that is made again; given up for an iteration where the energy would rise
CONVERGED = 1e-6  # relative drop of the energy in one iteration at which it has settled
MIN_CURVATURE = 1e-3  # of a center that owns nothing and has no neighbors: it stays where it is

SamplesOf = Callable[[int], VolumeSamples]


@dataclass(frozen=True)
class SequenceState(FrozenArrays):
    """Positions (F, C, 3) with the parts of their energy.

    masses : (F, C) of the cells, as multiples of the frame's mean.  centroids : (F, C, 3) of the cells.
    lloyd_energy, arap_energy : (F,) in s^2; the latter from the frame before.
    """

    positions: np.ndarray
    masses: np.ndarray
    centroids: np.ndarray
    lloyd_energy: np.ndarray
    arap_energy: np.ndarray

    @classmethod
    def of(cls, positions: np.ndarray, misfit: RigidMisfit, samples_of: SamplesOf, spacing: float) -> SequenceState:
        """positions : (F, C, 3).  samples_of : the volume of a frame by its row.  spacing : s, scene units."""
        cells = [lloyd.cells(centers, Ownership(samples_of(frame))) for frame, centers in enumerate(positions)]
        arap = [0.0, *(misfit(before, after)[0] for before, after in zip(positions, positions[1:], strict=False))]
        return cls(
            positions,
            masses=np.stack([cell.masses / cell.masses.mean() for cell in cells]),
            centroids=np.stack([cell.centroids for cell in cells]),
            lloyd_energy=np.array([cell.energy for cell in cells]) / spacing**2,
            arap_energy=np.array(arap) / spacing**2,
        )

    @property
    def energy(self) -> float:
        """What is minimized: the sum over all frames, in s^2."""
        return float(self.lloyd_energy.sum() + RIGIDITY * self.arap_energy.sum())


def minimized(
    positions: np.ndarray, weights: sparse.spmatrix, samples_of: SamplesOf, spacing: float, progress: Progress = ignore
) -> tuple[SequenceState, np.ndarray]:
    """The state of lower energy reached from (F, C, 3) positions, and the energies (I + 1,) on the way, in s^2.

    weights : (C, C) affinities.  samples_of : the volume of a frame by its row.  spacing : s, scene units.
    """
    misfit = RigidMisfit(weights)
    state, change = SequenceState.of(positions, misfit, samples_of, spacing), np.zeros(positions.shape)
    energies = [state.energy]
    for iteration in range(ITERATIONS):
        descended = _descended(state, misfit, partial(progress, iteration / ITERATIONS))
        for momentum in (MOMENTUM, 0.0):
            candidate = SequenceState.of(descended + momentum * change, misfit, samples_of, spacing)
            if candidate.energy < state.energy:
                break
        else:
            break
        change, state = candidate.positions - state.positions, candidate
        energies.append(state.energy)
        if energies[-1] > (1 - CONVERGED) * energies[-2]:
            break
    progress(1.0)
    return state, np.array(energies)


def _descended(state: SequenceState, misfit: RigidMisfit, pulse: Callable[[], None]) -> np.ndarray:
    """Positions (F, C, 3) after steps down the energy whose cells keep their masses and centroids. pulse : called at each step."""
    positions, step, curvature = state.positions, np.zeros(state.positions.shape), _curvature(state, misfit)
    for taken in range(INNER_STEPS):
        pulse()
        step = taken / (taken + 3) * step - _gradient(positions, state, misfit) / curvature  # Nesterov's growing momentum
        positions = positions + step
    return positions


def _curvature(state: SequenceState, misfit: RigidMisfit) -> np.ndarray:
    """(F, C, 1) of the energy along each center."""
    curvature = state.masses.copy()
    curvature[1:] += RIGIDITY * misfit.curvature
    curvature[:-1] += RIGIDITY * misfit.curvature
    return np.maximum(curvature, MIN_CURVATURE)[..., None]


def _gradient(positions: np.ndarray, state: SequenceState, misfit: RigidMisfit) -> np.ndarray:
    """(F, C, 3) C/2 times the gradient of the energy at other positions, with the cells of `state` held."""
    gradient = state.masses[..., None] * (positions - state.centroids)
    for frame in range(1, len(positions)):
        _, before, after = misfit(positions[frame - 1], positions[frame])
        gradient[frame - 1] += RIGIDITY * before
        gradient[frame] += RIGIDITY * after
    return gradient
