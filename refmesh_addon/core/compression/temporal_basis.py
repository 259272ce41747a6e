"""Few shapes over time instead of many frames: a Karhunen-Loeve transform, rounded to integers."""

from __future__ import annotations

import numpy as np

from .coder import FRACTION, Coder, magnitude_classes

BITS = 9  # binary digits of the entries


def fitted_basis(fields: np.ndarray) -> np.ndarray:
    """(F, F) integers in 2^-BITS; column k is the k-th strongest course over the frames.  fields : (F, N)."""
    _, columns = np.linalg.eigh(fields @ fields.T)
    columns = columns[:, ::-1]
    signs = np.sign(columns[np.abs(columns).argmax(axis=0), np.arange(len(columns))])
    return np.rint(columns * signs * (1 << BITS))


def coefficients(basis: np.ndarray, fields: np.ndarray) -> np.ndarray:
    """(K, N) with the least squared error over the frames.  basis : (F, K).  fields : (F, N)."""
    return np.linalg.lstsq(basis / (1 << BITS), fields, rcond=None)[0]


def courses_above(coefficients: np.ndarray, limit: float) -> int:
    """How many of the first courses have to be kept, so that all others stay below a limit.  coefficients : (K, N)."""
    return int(np.flatnonzero(np.abs(coefficients).max(axis=1, initial=0.0) >= limit).max(initial=-1)) + 1


def over_frames(basis: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(F, N) whole numbers from (K, N) whole coefficients; exact before it is rounded, whatever multiplies the matrices."""
    return np.rint((basis @ values) / (1 << BITS))


def coded_basis(coder: Coder, basis: np.ndarray | None, frames: int) -> np.ndarray:
    """(F, K) integers in float64; only the first K columns are coded.  basis : (F, K), None when decoding."""
    kept = coder.number(None if basis is None else basis.shape[1], frames + 1)
    expected = np.full(frames * kept, int(FRACTION * (1 << BITS) / max(frames, 1) ** 0.5 / 1.5), dtype=np.int64)
    values = None if basis is None else basis.ravel().astype(np.int64)
    return coder.integers(values, magnitude_classes(expected)).reshape(frames, kept).astype(np.float64)
