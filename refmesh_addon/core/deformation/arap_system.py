"""Minimizing the energy of as-rigid-as-possible deformation for one set of constraints.

Rotations (local step) and positions (global step) are minimized in turn. Each step minimizes or lowers the energy exactly, so it
never rises.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..geometry.factor import factored
from ..geometry.vectors import row_dot
from ..types import FrozenArrays
from .arap_energy import ArapEnergy, RestShape
from .conjugate_gradients import conjugate_gradients

# Pull toward the start of components without constraints: it decides where they lie and must not decide their shape.
UNCONSTRAINED_WEIGHT = 1e-3


@dataclass(frozen=True)
class Deformation(FrozenArrays):
    """vertices : (R, 3) scene units.  rotations : (R, 3, 3).
    energies : (iterations done + 1,) scene units squared, that of the start first.
    """

    vertices: np.ndarray
    rotations: np.ndarray
    energies: np.ndarray


@dataclass(frozen=True)
class Constraints:
    """Points of the surface and vertices that have targets, and how strongly.

    rows : (K, R) sparse, each row the barycentric weights of one point.  weights : (K,) of these, no unit.
    fixed : (H,) vertices that meet their targets exactly.  start_weight : of every vertex's pull to its start.
    """

    rows: sparse.csr_matrix
    weights: np.ndarray
    fixed: np.ndarray
    start_weight: float = 0.0

    @classmethod
    def at_points(cls, rows: sparse.spmatrix, weights: np.ndarray) -> Constraints:
        """Soft constraints only."""
        return cls(rows.tocsr(), weights, np.empty(0, dtype=np.int64))


@dataclass(frozen=True)
class Targets:
    """Where constrained points and vertices go.

    points : (K, 3).  fixed : (H, 3) of the fixed vertices, or None where there are none.
    normals : (K, 3) unit normals of planes through the targets, in which the points may slide; None for plain points.
    plane_steps : steps of conjugate gradients toward the planes in each global step.
    """

    points: np.ndarray
    fixed: np.ndarray | None = None
    normals: np.ndarray | None = None
    plane_steps: int = 1


@dataclass(frozen=True)
class Start:
    """vertices : (R, 3).  rotations : (R, 3, 3) from an earlier solution; None takes those that fit the vertices best."""

    vertices: np.ndarray
    rotations: np.ndarray | None = None


class ArapSystem:
    """One set of constraints, factorized: solved for any number of targets."""

    def __init__(self, energy: ArapEnergy, constraints: Constraints):
        self.energy, self.constraints = energy, constraints
        rows, fixed = constraints.rows, constraints.fixed
        self.pull = rows.multiply(constraints.weights[:, None]).T.tocsr()
        self.start_weights = np.maximum(UNCONSTRAINED_WEIGHT * ~self._constrained(), constraints.start_weight)
        self.free = np.setdiff1d(np.arange(len(energy.components)), fixed)
        matrix = (2.0 * energy.laplacian + self.pull @ rows + sparse.diags(self.start_weights)).tocsr()[self.free]
        self.coupling, self.matrix = matrix[:, fixed], matrix[:, self.free].tocsc()
        self.factor = factored(self.matrix)

    def solve(
        self, targets: Targets, start: Start, iterations: int, tolerance: float = 0.0, rest: RestShape | None = None
    ) -> Deformation:
        """At most `iterations` of global and local steps.

        tolerance : the iterations end early with one that lowers the energy by no more than this share.
        rest : a rest shape other than the mesh's own, from `ArapEnergy.rest_shape`.
        Raises ValueError where the start does not match the mesh.
        """
        state = _State(self, targets, start, rest or self.energy.rest)
        energies = [state.energy()]
        for _ in range(iterations):
            state.global_step()
            state.local_step()
            energies.append(state.energy())
            if energies[-2] - energies[-1] <= tolerance * energies[-2]:
                break
        return Deformation(state.positions + state.origin, state.rotations(), np.array(energies))

    def _constrained(self) -> np.ndarray:
        """(R,) bool, whether the vertex's component has a constraint."""
        result = np.zeros(self.energy.component_count, dtype=bool)
        result[self.energy.components[self.constraints.rows.indices]] = True
        result[self.energy.components[self.constraints.fixed]] = True
        return result[self.energy.components]


class _State:
    """Current positions and rotations, relative to the start's center so that far-away coordinates lose no digits."""

    def __init__(self, system: ArapSystem, targets: Targets, start: Start, rest: RestShape):
        vertices, shape = np.asarray(start.vertices, dtype=np.float64), system.energy.mesh.vertices.shape
        if vertices.shape != shape:
            raise ValueError(f"start must be {shape} to match the mesh; got {vertices.shape}")
        self.system, self.rest = system, rest
        self.origin = vertices.mean(axis=0)
        self.start = vertices - self.origin
        self.targets, self.normals, self.plane_steps = targets.points - self.origin, targets.normals, targets.plane_steps
        self.positions = self.start.copy()
        self.covariance = self._covariance()
        self.transposed = self._first_rotations(start)  # (R, 9): every rotation's transpose, row-major
        if len(system.constraints.fixed):
            self.positions[system.constraints.fixed] = targets.fixed - self.origin
            self.covariance = self._covariance()
        start_pull = system.start_weights[system.free, None] * self.start[system.free]
        self.constant = start_pull - system.coupling @ self.positions[system.constraints.fixed]

    def _first_rotations(self, start: Start) -> np.ndarray:
        """Those of the start, from before the fixed vertices jump, which rotates nothing by itself."""
        if start.rotations is None:
            return self.system.energy.smooth_rotations.lowered(None, self.covariance)
        return start.rotations.transpose(0, 2, 1).reshape(-1, 9)

    def local_step(self) -> None:
        """Rotations for these positions."""
        self.covariance = self._covariance()
        self.transposed = self.system.energy.smooth_rotations.lowered(self.transposed, self.covariance)

    def global_step(self) -> None:
        """The positions that minimize the energy for these rotations; with planes, some steps toward them."""
        free = self.system.free
        right_side = (self.rest.right_side @ self.transposed.reshape(-1, 3))[free] + self.constant
        if self.normals is None:
            self.positions[free] = self.system.factor.solve(right_side + (self.system.pull @ self.targets)[free])
        else:
            self.positions[free] = self._toward_planes(right_side, self.normals)

    def _toward_planes(self, right_side: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Positions of the free vertices. The system for points is the preconditioner: it is factorized, and it bounds that for planes,
        because the distance to a plane is never more than that to a point of it.
        """
        system, free = self.system, self.system.free

        def product(moves: np.ndarray) -> np.ndarray:
            every = np.zeros_like(self.positions)
            every[free] = moves
            along = system.constraints.rows @ every
            in_plane = along - normals * row_dot(normals, along)[:, None]
            return system.matrix @ moves - (system.pull @ in_plane)[free]

        ahead = (system.pull @ (self.targets + self._offsets()[1]))[free]
        residual = right_side + ahead - system.matrix @ self.positions[free]
        return conjugate_gradients(product, system.factor.solve, self.positions[free], residual, self.plane_steps)

    def _offsets(self) -> tuple[np.ndarray, np.ndarray]:
        """(K, 3) of each constrained point from its target: the part that counts, and the part that is free."""
        offsets = self.system.constraints.rows @ self.positions - self.targets
        if self.normals is None:
            return offsets, np.zeros_like(offsets)
        counted = self.normals * row_dot(self.normals, offsets)[:, None]
        return counted, offsets - counted

    def rotations(self) -> np.ndarray:
        return np.ascontiguousarray(self.transposed.reshape(-1, 3, 3).transpose(0, 2, 1))

    def _covariance(self) -> np.ndarray:
        return (self.rest.covariance @ self.positions).reshape(-1, 9)

    def energy(self) -> float:
        """Of these positions and rotations, scene units squared."""
        system = self.system
        missed = np.square(self._offsets()[0]).sum(axis=1)
        moved = np.square(self.positions - self.start).sum(axis=1)
        shape = system.energy.of(self.positions, self.transposed, self.covariance, self.rest)
        return float(shape + system.constraints.weights @ missed + system.start_weights @ moved)
