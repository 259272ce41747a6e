"""The local step of smooth-rotation ARAP: one rotation for each vertex, close to its own data and to its neighbors.

Minimizes  f(R) = -<R, C> - beta <R, W R>  over all rotations, where C are covariance sums and W is the adjacency: up to a
constant half of the ARAP energy for fixed positions. Updating each rotation from its neighbors alone propagates information
by one edge per sweep, which takes thousands of sweeps once beta is large, so a step of Newton's method on all rotations
together comes first and is kept where it lowers f.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.factor import factored
from ..geometry.rotations import closest_rotations, rotation_matrices

# Share of the neighbors' weight added to each vertex, so that vertices without data or neighbors stay solvable.
FLOOR = 1e-9


class SmoothRotations:
    """adjacency : (R, R) of `triangle_adjacency`.  beta : (alpha A), scene units squared, 0 for independent rotations.
    spread : (R,) sums of w_ij |p_i - p_j|^2 in the rest shape, scene units squared.
    """

    def __init__(self, adjacency: sparse.csr_matrix, beta: float, spread: np.ndarray):
        self.adjacency, self.beta = adjacency, beta
        self.neighbor_weights = np.asarray(adjacency.sum(axis=1))
        if beta > 0:
            # Hessian for nearly rigid data: 2/3 of the spread on average over the axes, and the graph Laplacian.
            coupling = 4.0 * beta * (sparse.diags(self.neighbor_weights.ravel()) - adjacency)
            hessian = sparse.diags(2.0 / 3.0 * spread + FLOOR * beta) + coupling
            self._hessian = factored(hessian)

    def lowered(self, rotations: np.ndarray | None, covariance: np.ndarray) -> np.ndarray:
        """Rotations with lower (never higher) f; the exact minimum where beta is 0.

        rotations : (R, 9) row-major; None starts from the rotations closest to the covariances.  covariance : (R, 9).  Returns (R, 9).
        """
        if rotations is None or self.beta == 0:
            rotations = _closest(covariance)
        if self.beta == 0:
            return rotations
        rotations, near = self._newton(rotations, covariance)
        # f is concave once W has half its row sums on the diagonal, which is constant on rotations: on each triangle
        # x^T W x + |x|^2 / 2 is a square. Minimizing its tangent, vertex by vertex, can therefore only lower it.
        return _closest(covariance + 2.0 * self.beta * (near + 0.5 * self.neighbor_weights * rotations))

    def energy(self, rotations: np.ndarray) -> float:
        """beta times the sum over i and j in N(i) of |R_i - R_j|^2, scene units squared."""
        if self.beta == 0:
            return 0.0
        return 2.0 * self.beta * (3.0 * self.neighbor_weights.sum() - np.vdot(rotations, self.adjacency @ rotations))

    def _newton(self, rotations: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotations after one step, where it lowers f, and the sums over their neighbors."""
        near = self.adjacency @ rotations
        torque = _axial(covariance + 2.0 * self.beta * near, rotations)
        rotated = (_from_vectors(self._hessian.solve(torque)) @ rotations.reshape(-1, 3, 3)).reshape(-1, 9)
        near_rotated = self.adjacency @ rotated
        if self._value(rotated, near_rotated, covariance) < self._value(rotations, near, covariance):
            return rotated, near_rotated
        return rotations, near

    def _value(self, rotations: np.ndarray, near: np.ndarray, covariance: np.ndarray) -> float:
        return -float(np.vdot(rotations, covariance) + self.beta * np.vdot(rotations, near))


def _closest(m: np.ndarray) -> np.ndarray:
    return closest_rotations(m.reshape(-1, 3, 3)).reshape(-1, 9)


def _axial(m: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """(N, 3) axial vectors of m R^T: the slope of <R, m> as R turns about each axis. Both (N, 9).

    Sum over the columns of R x m; whole arrays for each entry, since products of many small matrices are slow.
    """
    a, b = np.ascontiguousarray(rotations.T).reshape(3, 3, -1), np.ascontiguousarray(m.T).reshape(3, 3, -1)
    return np.stack([sum(a[y, j] * b[z, j] - a[z, j] * b[y, j] for j in range(3)) for y, z in ((1, 2), (2, 0), (0, 1))], axis=1)


def _from_vectors(vectors: np.ndarray) -> np.ndarray:
    """(N, 3) axis times angle in radians, as (N, 3, 3) rotations."""
    half = 0.5 * np.linalg.norm(vectors, axis=1)
    return rotation_matrices(np.vstack([np.cos(half), 0.5 * np.sinc(half / np.pi) * vectors.T]))
