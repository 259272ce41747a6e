"""As-rigid-as-possible deformation of a mesh by handles. The energy is that of `arap_energy`."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.mesh import submesh, triangle_areas, triangles_at
from ..geometry.vectors import TINY
from ..types import TriangleMesh
from .arap_energy import ArapEnergy
from .arap_system import ArapSystem, Constraints, Deformation, Start, Targets


class ArapSolver:
    """Built once from a mesh, then deforms it any number of times.

    mesh : the rest shape; several components and vertices without triangles are allowed.
    smoothness : alpha, no unit, 0 for plain as-rigid-as-possible.
    tolerance : iterations of `deform` end early with one that lowers the energy by no more than this share of it.
    Raises ValueError for a negative smoothness.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> deformation = ArapSolver(square).deform([0], square.vertices[:1] + [0, 0, 5], square.vertices, weight=np.inf)
    >>> deformation.vertices[0]
    array([0., 0., 5.])
    """

    def __init__(self, mesh: TriangleMesh, smoothness: float = 0.01, tolerance: float = 0.0):
        self.energy = ArapEnergy(mesh, smoothness)
        self._tolerance = tolerance
        self._latest: tuple[bytes, ArapSystem] | None = None

    @property
    def mesh(self) -> TriangleMesh:
        """The rest shape."""
        return self.energy.mesh

    def deform(
        self,
        handles: np.ndarray,
        targets: np.ndarray,
        start: np.ndarray,
        weight: float | np.ndarray = 1.0,
        iterations: int = 10,
        start_weight: float = 0.0,
    ) -> Deformation:
        """Moves the handles to their targets and everything else as rigidly as possible.

        handles : (K,) distinct vertex indices.  targets : (K, 3) scene units.  start : (R, 3) first guess.
        weight : one number or (K,), no unit, in cotangent weights (an edge of a regular mesh has 0.58); inf for hard handles.
        start_weight : of every vertex's pull to its start, for a start that is already good far from the handles.
        The factorization is kept for the next call with the same handles and weights.
        Raises ValueError for shapes, indices or weights that do not fit.
        """
        handles = np.asarray(handles, dtype=np.int64)
        weights = np.broadcast_to(np.asarray(weight, dtype=np.float64), handles.shape)
        targets = np.asarray(targets, dtype=np.float64)
        self._check_handles(handles, targets, weights)
        hard = np.isinf(weights)
        system = self._system(handles, weights, start_weight)
        return system.solve(Targets(targets[~hard], targets[hard]), Start(start), iterations, self._tolerance)

    def system(self, constraints: Constraints) -> ArapSystem:
        """The factorized system for constraints on any points of the surface."""
        return ArapSystem(self.energy, constraints)

    def part(self, chosen: np.ndarray) -> tuple[np.ndarray, ArapSolver]:
        """The solver of the triangles that have a corner among the (R,) bool chosen vertices, and which (P,) vertices these have.

        The balance of the two terms of the energy stays that of the whole.
        """
        mesh, kept = submesh(self.mesh, triangles_at(self.mesh, chosen))
        area = max(float(triangle_areas(mesh).sum()), float(TINY))
        return kept, ArapSolver(mesh, self.energy.smoothness * self.energy.area / area)

    def _system(self, handles: np.ndarray, weights: np.ndarray, start_weight: float) -> ArapSystem:
        """That of the last call where nothing but targets has changed."""
        key = handles.tobytes() + weights.tobytes() + np.float64(start_weight).tobytes()
        if self._latest is None or self._latest[0] != key:
            hard = np.isinf(weights)
            rows = sparse.identity(len(self.mesh.vertices), format="csr")[handles[~hard]]
            self._latest = key, self.system(Constraints(rows, weights[~hard], handles[hard], start_weight))
        return self._latest[1]

    def _check_handles(self, handles: np.ndarray, targets: np.ndarray, weights: np.ndarray) -> None:
        count, distinct = len(self.mesh.vertices), len(np.unique(handles))
        if handles.ndim != 1 or distinct != len(handles):
            raise ValueError(f"handles must be a list of distinct vertices; got {handles.shape} with {distinct} distinct")
        if len(handles) and (handles.min() < 0 or handles.max() >= count):
            raise ValueError(f"handles must be from 0 to {count - 1}; got {handles.min()} to {handles.max()}")
        if targets.shape != (len(handles), 3):
            raise ValueError(f"targets must be ({len(handles)}, 3) to match the handles; got {targets.shape}")
        if not np.all(weights > 0):
            raise ValueError(f"weight must be above 0; got {weights.min()}")
