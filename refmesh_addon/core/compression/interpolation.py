"""Fine vertices from coarse ones: the smoothest surface through what is known, in integers.

What is predicted minimizes the squared distances of vertices from the mean of their neighbors, as least-squares meshes do
(Sorkine & Cohen-Or, SMI 2004).
The fine vertices of a level are not neighbors, so a few Jacobi steps come close enough. All values are integers held in
float64, below 2^53 in every sum, so that no order of summation and no fused instruction can change them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..types import FrozenArrays
from .coder import FRACTION
from .hierarchy import Level

SCALE = 36 << 10  # of the weights 1 / valence^2, which make of the graph Laplacian the distance from the mean, as integers
STEPS = 5  # Jacobi steps; a step leaves about 0.4 of the error


@dataclass(frozen=True)
class Stencil(FrozenArrays):
    """The equations of one level's fine vertices.

    fine : (U,) int64.  ring : (U, V) sparse, ones at the neighbors.  valence : (U, 1).
    energy : (U, V) sparse integers, rows of the weighted, squared Laplacian.  own : (U, 1), its diagonal.
    """

    fine: np.ndarray
    ring: sparse.csr_matrix
    valence: np.ndarray
    energy: sparse.csr_matrix
    own: np.ndarray

    def mean_magnitudes(self, magnitudes: np.ndarray) -> np.ndarray:
        """(U, K) int64 mean over the neighbors of (V, K) whole magnitudes, in 1 / FRACTION."""
        return ((self.ring @ magnitudes.astype(np.float64)) * FRACTION // self.valence).astype(np.int64)


def stencil(level: Level) -> Stencil:
    """The equations of a level, built once for every field that is predicted on it."""
    ring = level.adjacency[level.fine]
    valence = np.diff(level.adjacency.indptr).astype(np.float64)
    laplacian = (sparse.diags(valence) - level.adjacency).tocsr()
    weights = sparse.diags(np.rint(SCALE / np.maximum(valence, 1.0) ** 2))
    energy = (laplacian[level.fine] @ weights @ laplacian).tocsr()
    own = np.asarray(energy[np.arange(len(level.fine)), level.fine]).reshape(-1, 1)
    return Stencil(level.fine, ring, valence[level.fine, None], energy, own)


def interpolated(stencil: Stencil, values: np.ndarray) -> np.ndarray:
    """(U, K) integers for the fine vertices of a level.

    values : (V, K) integers in float64, right at the level's other vertices; not changed.
    """
    work = values.copy()
    work[stencil.fine] = np.rint((stencil.ring @ values) / stencil.valence)
    for _ in range(STEPS):
        work[stencil.fine] -= np.rint((stencil.energy @ work) / stencil.own)
    return work[stencil.fine]
