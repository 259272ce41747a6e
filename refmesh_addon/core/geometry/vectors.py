"""Rows of vectors: dot products and lengths."""

from __future__ import annotations

import numpy as np

TINY = np.finfo(np.float64).tiny  # keeps 0 / 0 away from vectors without length and moves no other value


def row_dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N,) dot products of the rows of (N, K) a and b."""
    return np.einsum("ij,ij->i", a, b)


def normalized(vectors: np.ndarray) -> np.ndarray:
    """(..., K) vectors scaled to unit length; zero vectors stay zero."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), TINY)
