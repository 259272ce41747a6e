"""How far neighborhoods of centers are from moving rigidly between two frames, with gradients (Dvorak et al., ICCS 2023)."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.rotations import rigid_motions


class RigidMisfit:
    """The misfit of rigid motion between any two frames, for one set of affinities.

    The energy is the mean over neighborhoods i of the mean over their centers j, by affinity, of |A_i x_j - y_j|^2,
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
