"""Sparse factorisation of the symmetric positive definite systems of surfaces."""

from __future__ import annotations

from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu


def factored(matrix: sparse.spmatrix) -> SuperLU:
    """The factor of a symmetric positive definite matrix: no pivoting is needed, and the ordering for A + A^T fills in least."""
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
