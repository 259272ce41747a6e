"""As-rigid-as-possible deformation with smooth rotations (Levi & Gotsman 2015; the paper, deformation re-meshing).

The energy of positions p' and one rotation R_i for each vertex, against the rest positions p:

    sum over i, j in N(i):  w_ij |(p'_i - p'_j) - R_i (p_i - p_j)|^2  +  alpha A |R_i - R_j|^2
    + sum over constraints: weight_k |b_k p' - target_k|^2            (soft; hard ones are met exactly; with a normal n_k only
                                                                       the distance along it counts: point to plane)
    + sum over vertices: hold_i |p'_i - start_i|^2                    (what the caller wants to keep; else HOLD in components
                                                                       without any constraint, and 0 elsewhere)

w are cotangent weights, A is the surface area and alpha the smoothness: both terms are areas, so the balance does not
depend on the scale, and since |R_i - R_j|^2 shrinks like the squared edge length while the number of edges grows, it
does not depend on the number of triangles either. On the boundary of an open mesh the second term counts half.

Rotations and positions are minimised in turn. Each turn minimises or lowers the energy exactly, so it never rises.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from ..geometry.cotangent import cotangent_weights, spokes, triangle_adjacency
from ..geometry.factor import factored
from ..geometry.mesh import submesh, triangle_areas, triangles_at, vertex_components
from ..geometry.vectors import TINY, row_dot
from ..types import FrozenArrays, TriangleMesh
from .smooth_rotations import SmoothRotations

# Pull of components without constraints towards where they start: it decides their place and must not decide their shape.
HOLD = 1e-3


@dataclass(frozen=True)
class Deformation(FrozenArrays):
    """vertices : (R, 3) scene units.  rotations : (R, 3, 3).  energies : (at most iterations + 1,) scene units squared, from the start
    on; without the start's where its rotations were given.
    """

    vertices: np.ndarray
    rotations: np.ndarray
    energies: np.ndarray


class ArapSolver:
    """Built once from a reference mesh, asked for many deformations of it.

    mesh : the rest shape; several components and vertices without triangles are allowed.
    smoothness : alpha, no unit, 0 for plain as-rigid-as-possible.
    Raises ValueError for a negative smoothness.
    """

    def __init__(self, mesh: TriangleMesh, smoothness: float = 0.01):
        if not smoothness >= 0:
            raise ValueError(f"smoothness must be 0 or more; got {smoothness}")
        self.mesh, self.smoothness, self.area = mesh, smoothness, float(triangle_areas(mesh).sum())
        self.weights = cotangent_weights(mesh)
        self.laplacian = (sparse.diags(_row_sums(self.weights)) - self.weights).tocsr()
        centred = mesh.vertices - mesh.vertices.mean(axis=0)
        spread = 2.0 * row_dot(centred, self.laplacian @ centred) - self.laplacian @ row_dot(centred, centred)
        self.adjacency = triangle_adjacency(mesh)
        self.local_step = SmoothRotations(self.adjacency, smoothness * self.area, spread)
        self.component_count, self.components = vertex_components(mesh)
        self._last: tuple[bytes, ArapSystem] | None = None
        self._own_rest: tuple | None = None
        self._rest: tuple[np.ndarray, tuple] | None = None

    def deform(
        self,
        handles: np.ndarray,
        targets: np.ndarray,
        start: np.ndarray,
        weight: float | np.ndarray = 1.0,
        iterations: int = 10,
        keep: float = 0.0,
        settled: float = 0.0,
    ) -> Deformation:
        """Moves the handles to their targets and everything else as rigidly as possible.

        handles : (K,) distinct vertex indices.  targets : (K, 3) scene units.  start : (R, 3) first guess.
        weight : one number or (K,), no unit, in cotangent weights (an edge of a regular mesh has 0.58); inf for hard handles.
        keep : weight of every vertex's pull to its start, for a start that is already good far from the handles.
        settled : iterations end early with one that lowers the energy by no more than this share of it.
        The factorisation is kept for the next call with the same handles and weights.
        Raises ValueError for shapes, indices or weights that do not fit.
        """
        handles = np.asarray(handles, dtype=np.int64)
        weights = np.broadcast_to(np.asarray(weight, dtype=np.float64), handles.shape)
        targets = np.asarray(targets, dtype=np.float64)
        self._check_handles(handles, targets, weights)
        key = handles.tobytes() + weights.tobytes() + np.float64(keep).tobytes()
        if self._last is None or self._last[0] != key:
            hard = np.isinf(weights)
            selection = sparse.identity(len(self.mesh.vertices), format="csr")[handles[~hard]]
            self._last = key, self.system(selection, weights[~hard], handles[hard], keep)
        hard = np.isinf(weights)
        return self._last[1].solve(targets[~hard], start, iterations, settled, fixed_targets=targets[hard])

    def system(self, rows: sparse.spmatrix, weights: np.ndarray, fixed: np.ndarray | tuple = (), keep: float = 0.0) -> ArapSystem:
        """The factorised system for constraints on points of the surface.

        rows : (K, R) sparse, each row the barycentric weights of one constrained point.  weights : (K,) no unit.
        fixed : vertices met exactly.  keep : weight of every vertex's pull to its start.
        """
        return ArapSystem(self, sparse.csr_matrix(rows), np.asarray(weights, dtype=np.float64), np.asarray(fixed, dtype=np.int64), keep)

    def part(self, chosen: np.ndarray) -> tuple[np.ndarray, ArapSolver]:
        """The solver of the triangles that have a corner among the (R,) bool chosen vertices, and the (P,) vertices it has left.

        The balance of the two terms of the energy stays that of the whole.
        """
        mesh, kept = submesh(self.mesh, triangles_at(self.mesh, chosen))
        return kept, ArapSolver(mesh, self.smoothness * self.area / max(float(triangle_areas(mesh).sum()), float(TINY)))

    def rest_operators(self, rest: np.ndarray) -> tuple[sparse.csr_matrix, sparse.csr_matrix, float]:
        """`spokes` of a rest shape (R, 3), its transpose, and the sum of w_ij |p_i - p_j|^2.

        Those of the mesh itself and of the last other shape are kept.
        """
        if rest is self.mesh.vertices:
            self._own_rest = self._own_rest or self._made_for(rest)
            return self._own_rest
        if self._rest is None or not np.array_equal(self._rest[0], rest):
            self._rest = rest.copy(), self._made_for(rest)
        return self._rest[1]

    def _made_for(self, rest: np.ndarray) -> tuple[sparse.csr_matrix, sparse.csr_matrix, float]:
        centred = rest - rest.mean(axis=0)
        matrix = spokes(self.weights, centred)
        return matrix, matrix.T.tocsr(), 2.0 * float(np.vdot(centred, self.laplacian @ centred))

    def _check_handles(self, handles: np.ndarray, targets: np.ndarray, weights: np.ndarray) -> None:
        count = len(self.mesh.vertices)
        if handles.ndim != 1 or len(np.unique(handles)) != len(handles):
            raise ValueError(f"handles must be a list of distinct vertices; got {handles.shape} with {len(np.unique(handles))} distinct")
        if len(handles) and (handles.min() < 0 or handles.max() >= count):
            raise ValueError(f"handles must be from 0 to {count - 1}; got {handles.min()} to {handles.max()}")
        if targets.shape != (len(handles), 3):
            raise ValueError(f"targets must be ({len(handles)}, 3) to match the handles; got {targets.shape}")
        if not np.all(weights > 0):
            raise ValueError(f"weight must be above 0; got {weights.min()}")


class ArapSystem:
    """One set of constraints, factorised: solved for as many targets as wanted."""

    def __init__(self, solver: ArapSolver, rows: sparse.csr_matrix, weights: np.ndarray, fixed: np.ndarray, keep: float):
        self.solver, self.fixed = solver, fixed
        self.rows, self.weights = rows, weights
        self.pull = rows.multiply(weights[:, None]).T.tocsr()
        self.hold = np.maximum(HOLD * ~self._reached(), keep)
        self.free = np.setdiff1d(np.arange(len(solver.components)), fixed)
        matrix = (2.0 * solver.laplacian + self.pull @ rows + sparse.diags(self.hold)).tocsr()[self.free]
        self.coupling, self.matrix = matrix[:, fixed], matrix[:, self.free].tocsc()
        self.factor = factored(self.matrix)

    def solve(self, targets: np.ndarray, start: np.ndarray, iterations: int, settled: float = 0.0, **options) -> Deformation:
        """Local and global steps in turn, `iterations` of each after a first local step.

        targets : (K, 3) of the constrained points.  start : (R, 3).  settled : as in `ArapSolver.deform`.
        options : `fixed_targets` (len(fixed), 3); `rest` (R, 3), a rest shape other than the mesh's own; `normals` (K, 3), unit
        normals of planes through the targets in which the points may slide, and `slides`, how often they do so per iteration;
        `rotations` (R, 3, 3) that the start has from an earlier solution: the first local step is left out then.
        """
        state = _State(self, targets, np.asarray(start, dtype=np.float64), **options)
        energies = [] if "rotations" in options else [state.energy()]
        for _ in range(iterations):
            state.move()
            state.turn()
            energies.append(state.energy())
            if len(energies) > 1 and energies[-2] - energies[-1] <= settled * energies[-2]:
                break
        return Deformation(state.positions + state.origin, state.rotations(), np.array(energies))

    def _reached(self) -> np.ndarray:
        """(R,) bool, whether the vertex's component has a constraint."""
        used = np.zeros(self.solver.component_count, dtype=bool)
        used[self.solver.components[self.rows.indices]] = True
        used[self.solver.components[self.fixed]] = True
        return used[self.solver.components]


class _State:
    """Positions and rotations on their way down. Kept about the start's centre, so that far-away coordinates lose no digits."""

    def __init__(
        self,
        system: ArapSystem,
        targets: np.ndarray,
        start: np.ndarray,
        fixed_targets: np.ndarray | None = None,
        rest: np.ndarray | None = None,
        normals: np.ndarray | None = None,
        slides: int = 1,
        rotations: np.ndarray | None = None,
    ):
        self.system, self.solver = system, system.solver
        rest = self.solver.mesh.vertices if rest is None else rest
        if start.shape != rest.shape:
            raise ValueError(f"start must be {rest.shape} to match the mesh; got {start.shape}")
        self.origin = start.mean(axis=0)
        self.start = start - self.origin
        self.targets, self.normals, self.slides = targets - self.origin, normals, slides
        self.spokes, self.gather, self.rest_size = self.solver.rest_operators(rest)
        self.positions = self.start.copy()
        # (R, 9): every rotation's transpose, row-major
        self.transposed: Any = None if rotations is None else rotations.transpose(0, 2, 1).reshape(-1, 9)
        if rotations is None:
            self.turn()  # before the hard handles jump, which turns nothing by itself
        if fixed_targets is not None:
            self.positions[system.fixed] = fixed_targets - self.origin
        self.steady = system.hold[system.free, None] * self.start[system.free] - system.coupling @ self.positions[system.fixed]

    def turn(self) -> None:
        """Local step: rotations for these positions."""
        self.transposed = self.solver.local_step.lowered(self.transposed, self._covariance())

    def move(self) -> None:
        """Global step: the positions that minimise the energy for these rotations; with planes, on the way to them."""
        free = self.system.free
        steady = (self.gather @ self.transposed.reshape(-1, 3))[free] + self.steady
        if self.normals is None:
            self.positions[free] = self.system.factor.solve(steady + (self.system.pull @ self.targets)[free])
        else:
            self._slide(steady, self.normals)

    def _slide(self, steady: np.ndarray, normals: np.ndarray) -> None:
        """Conjugate gradients for planes; what they are asked beyond points is the same factorisation, as the preconditioner.

        The distance to a plane is never more than that to a point of it, so the system for points bounds that for planes.
        """
        system, free = self.system, self.system.free
        ahead = (system.pull @ (self.targets + self._offsets()[1]))[free]
        rest = steady + ahead - system.matrix @ self.positions[free]
        step = way = system.factor.solve(rest)
        size, moves = np.vdot(rest, step), np.zeros_like(self.positions)
        for slide in range(self.slides):
            if not size > 0:
                break
            moves[free] = way
            along = system.rows @ moves
            pulled = system.matrix @ way - (system.pull @ (along - normals * row_dot(normals, along)[:, None]))[free]
            share = size / np.vdot(way, pulled)
            self.positions[free] += share * way
            if slide == self.slides - 1:
                break
            rest = rest - share * pulled
            step = system.factor.solve(rest)
            before, size = size, np.vdot(rest, step)
            way = step + (size / before) * way

    def _offsets(self) -> tuple[np.ndarray, np.ndarray]:
        """(K, 3) of each constrained point from its target: the part that counts, and the part that is free."""
        offsets = self.system.rows @ self.positions - self.targets
        if self.normals is None:
            return offsets, np.zeros_like(offsets)
        counted = self.normals * row_dot(self.normals, offsets)[:, None]
        return counted, offsets - counted

    def rotations(self) -> np.ndarray:
        return np.ascontiguousarray(self.transposed.reshape(-1, 3, 3).transpose(0, 2, 1))

    def _covariance(self) -> np.ndarray:
        return (self.spokes @ self.positions).reshape(-1, 9)

    def energy(self) -> float:
        """Of these positions and rotations, scene units squared."""
        solver, system = self.solver, self.system
        size = 2.0 * np.vdot(self.positions, solver.laplacian @ self.positions)
        rigid = size + self.rest_size - 2.0 * np.vdot(self.transposed, self._covariance())
        smooth = solver.local_step.energy(self.transposed)
        missed = np.square(self._offsets()[0]).sum(axis=1)
        strayed = np.square(self.positions - self.start).sum(axis=1)
        return float(rigid + smooth + system.weights @ missed + system.hold @ strayed)


def _row_sums(matrix: sparse.spmatrix) -> np.ndarray:
    return np.asarray(matrix.sum(axis=1)).ravel()
