"""Ragged arrays: rows of different lengths, stored end to end."""

from __future__ import annotations

import numpy as np


def ragged_indices(lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Row and column, (M,) each, of the M entries of a ragged array whose N rows have (N,) lengths."""
    row = np.repeat(np.arange(len(lengths)), lengths)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(lengths) - lengths, lengths)


def sorted_by_label(labels: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Entries grouped by their (N,) labels in 0 to count - 1, each group in its order: a stable counting sort, linear in time.

    Returns order (N,) and starts (count + 1,): the entries with label k are order[starts[k] : starts[k + 1]].
    Raises ValueError for labels out of range.
    """
    if len(labels) and not 0 <= labels.min() <= labels.max() < count:
        raise ValueError(f"labels must be 0 to {count - 1}; got {labels.min()} to {labels.max()}")
    from scipy import sparse  # late: Blender's preview needs this module where scipy may be missing

    entries = np.ones(len(labels), dtype=np.int8), labels, np.arange(len(labels) + 1)
    by_label = sparse.csr_matrix(entries, shape=(len(labels), count)).tocsc()
    return by_label.indices, by_label.indptr
