"""How rigidly centers move between two frames: the ARAP energy on the affinity graph, and the step that lowers it.

    sum over pairs: a_ij |(c_i - c_j) - (R_i + R_j)/2 (o_i - o_j)|^2 / m

for centers c in the new frame and o in the old one, R_i the best rotation of the neighborhood of i, a the affinities and
m the mean over centers of their sums. Rotating an edge by the mean rotation of its two ends follows a bend or a twist to
second order; carrying each center by its neighborhood's single motion, as published, flattens it a little in every frame.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..geometry.factor import factored
from ..geometry.rotations import rigid_motions

LOOSE = 1e-6  # pull, relative to the rigidity, on centers that are carried: what nothing holds goes with the nearest that is held
SOLVER_STEPS = 6  # conjugate-gradient steps of one solve, started from the current centers; the outer loop continues from there


class Rigidity:
    """The rigidity between a frame with (C, 3) centers `old` and the next one, for (C, C) affinity weights."""

    def __init__(self, weights: sparse.csr_matrix, old: np.ndarray):
        self.weights, self.old = weights, old
        links = weights - sparse.diags(weights.diagonal())
        degrees = np.asarray(links.sum(axis=1)).ravel()
        mean = degrees.mean() if degrees.any() else 1.0
        self._links, self._degrees = (links / mean).tocsr(), degrees / mean
        self._old_laplacian = self._laplacian(old)

    def pulled(self, centers: np.ndarray, goals: np.ndarray, weight: float, steps: int = SOLVER_STEPS) -> np.ndarray:
        """(C, 3) centers nearer to the minimum of |c - goals|^2 + weight * rigidity, rotations held at those of `centers`.

        steps : of conjugate gradients.

        Solving for all centers at once lets a pull that only the surface feels move a whole limb in one step.
        """
        right = goals + weight * self._turned_laplacian(centers)
        return self._solved(centers, right, weight, steps)

    def carried(self, centers: np.ndarray, free: np.ndarray, iterations: int) -> np.ndarray:
        """(C, 3) centers with the free ones where the rigidity is least; the others stay where they are.

        centers : of the free ones, any value.  free : (C,) bool, not all.
        iterations : local/global, from the rigid motion about the nearest of the others.
        """
        held, centers = np.flatnonzero(~free), centers.copy()
        nearest = cKDTree(self.old[held]).query(self.old[free])[1]
        motions = rigid_motions(self.weights[held][:, held], self.old[held], centers[held]).of(nearest)
        centers[free] = start = motions.apply(self.old[free])
        laplacian = (sparse.diags(self._degrees) - self._links).tocsr()[free]
        factor = factored(laplacian[:, free] + LOOSE * sparse.eye(np.count_nonzero(free)))
        for _ in range(iterations):
            right = self._turned_laplacian(centers)[free] - laplacian[:, held] @ centers[held]
            centers[free] = factor.solve(right + LOOSE * start)
        return centers

    def _turned_laplacian(self, centers: np.ndarray) -> np.ndarray:
        """(C, 3) sums over j of a_ij (R_i + R_j)/2 (o_i - o_j)."""
        turns = rigid_motions(self.weights, self.old, centers).rotations
        turned = np.einsum("nij,nj->ni", turns, self.old)
        sums = self._links @ np.hstack([turns.reshape(-1, 9), turned])
        by_neighbors = np.einsum("nij,nj->ni", sums[:, :9].reshape(-1, 3, 3), self.old) - sums[:, 9:]
        return 0.5 * (np.einsum("nij,nj->ni", turns, self._old_laplacian) + by_neighbors)

    def _laplacian(self, values: np.ndarray) -> np.ndarray:
        return self._degrees[:, None] * values - self._links @ values

    def _solved(self, start: np.ndarray, right: np.ndarray, weight: float, steps: int) -> np.ndarray:
        """Conjugate gradients on (I + weight * Laplacian) c = right, the three coordinates side by side."""
        scale = 1.0 / (1.0 + weight * self._degrees)[:, None]
        centers = start
        residual = right - centers - weight * self._laplacian(centers)
        preconditioned = scale * residual
        direction, size = preconditioned, np.einsum("ij,ij->j", residual, preconditioned)
        for _ in range(steps):
            image = direction + weight * self._laplacian(direction)
            curvature = np.einsum("ij,ij->j", direction, image)
            length = np.divide(size, curvature, out=np.zeros(3), where=curvature > 0)
            centers = centers + length * direction
            residual = residual - length * image
            preconditioned = scale * residual
            new_size = np.einsum("ij,ij->j", residual, preconditioned)
            direction = preconditioned + np.divide(new_size, size, out=np.zeros(3), where=size > 0) * direction
            size = new_size
        return centers
