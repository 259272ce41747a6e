"""Lists of different lengths laid end to end."""

from __future__ import annotations

import numpy as np


def numbered(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For N lists of (N,) lengths end to end, which list each of all M entries is of, and its place in that, (M,) each."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
