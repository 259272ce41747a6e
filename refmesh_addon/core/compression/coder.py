"""What the models ask of an entropy coder, and the integer tables that it works with.

The same code of a model runs in both directions: an encoder passes values and gets them back, a decoder passes None and gets
what was encoded. So both see the same contexts, as long as these are integers.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

FRACTION = 256  # expected magnitudes are whole numbers of 1 / FRACTION
CLASSES = 48  # of expected magnitudes, in steps of half an octave
LARGEST = 14  # magnitude with a frequency of its own; larger ones escape
TOTAL = 1 << 16  # of the frequencies in a table
PARAMETERS = 3  # bytes that describe a table
_BOUNDS = np.array([(2 if odd == 0 else 3) * (1 << octave) // 2 for octave in range(CLASSES // 2) for odd in (0, 1)])


class Coder(Protocol):
    """An encoder or a decoder."""

    decoding: bool

    def integers(self, values: np.ndarray | None, classes: np.ndarray) -> np.ndarray:
        """(N,) int64 around 0.  classes : (N,) int64 in range(CLASSES), from `magnitude_classes`."""

    def choice(self, value: int | None, context: int, size: int) -> int:
        """One of `size` symbols, by frequencies that adapt in each context."""

    def number(self, value: int | None, bound: int) -> int:
        """One of range(bound), all as likely."""


def magnitude_classes(expected: np.ndarray) -> np.ndarray:
    """int64 class of each expected magnitude.  expected : integers in 1 / FRACTION, at least 0."""
    return np.searchsorted(_BOUNDS[1:], expected, side="right")


def low_bits(magnitude_class: int) -> int:
    """How many lowest bits of a value in this class are as good as random."""
    expected = int(_BOUNDS[magnitude_class])
    return max(0, (expected // (2 * FRACTION)).bit_length() - 1)


def table_parameters(counts: np.ndarray) -> tuple[int, int, int]:
    """Bytes (zero, one, decay) that describe how often magnitudes 0, 1, ... occurred.  counts : (LARGEST + 2,), the last for escapes."""
    magnitudes = np.arange(len(counts))
    total, nonzero, beyond = counts.sum(), counts[1:].sum(), counts[2:].sum()
    zero = (counts[0] + 0.4) / (total + 0.8)
    one = (counts[1] + 0.4) / (nonzero + 0.8)
    decay = (counts @ np.maximum(magnitudes - 2, 0) + 0.4) / (counts @ np.maximum(magnitudes - 1, 0) + 0.4 + 0.4 * (beyond == 0))
    return tuple(int(np.clip(np.rint(256 * share), 1, 255)) for share in (zero, one, decay))  # type: ignore[return-value]


def frequencies(parameters: tuple[int, int, int]) -> np.ndarray:
    """(2 * LARGEST + 3,) int64 with the sum TOTAL: of -LARGEST - 1, ..., LARGEST + 1, both ends standing for an escape.

    zero : share of 0 in 1/256.  one : share of magnitude 1 among the others.  decay : from each further magnitude to the next.
    """
    zero, one, decay = parameters
    halves, rest = [], (TOTAL - TOTAL * zero // 256) // 2
    for magnitude in range(1, LARGEST + 1):
        share = rest * (one if magnitude == 1 else 256 - decay) // 256
        halves.append(max(1, min(share, rest - (LARGEST + 1 - magnitude))))
        rest -= halves[-1]
    half = np.array([*halves, max(rest, 1)], dtype=np.int64)
    return np.concatenate([half[::-1], [TOTAL - 2 * half.sum()], half])
