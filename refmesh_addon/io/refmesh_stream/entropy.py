"""Models of a range coder, from integer tables only, by the package `constriction`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ...core.compression.coder import CLASSES, PARAMETERS
from ...core.errors import RefMeshError

GAIN = 8  # of a count when its symbol occurs: tables start equal and learn fast
RENEWED = 16  # a table that adapts is renewed when its counts have grown by one part in so many
MOST_COUNTED = 4096  # counts are halved beyond this sum
ESCAPE_BITS = 5  # that tell how many bits an escaped value has
HALF_WORD = 16  # numbers with more bits are coded in two parts
WORD = np.dtype("<u4")
Tables = dict[int, tuple[int, int, int]]  # class -> parameters of its frequencies


def load_constriction():
    """The package. Raises RefMeshError where it is missing."""
    try:
        import constriction
    except ImportError as error:
        raise RefMeshError(
            "compressed .refmesh files need the Python package 'constriction', which is not installed; all other formats work without it"
        ) from error
    return constriction


class Adaptive:
    """Frequencies of one context that follow what occurs, and the model of them."""

    def __init__(self, size: int, make: Callable[[np.ndarray], Any]):
        self._counts, self._make, self._since, self.model = [1] * size, make, 0, None
        self._renew()

    def _renew(self) -> None:
        total = sum(self._counts)
        if total > MOST_COUNTED:
            self._counts = [(count + 1) // 2 for count in self._counts]
        self.model = self._make(np.array(self._counts, dtype=np.float32))
        self._since = 0

    def count(self, symbol: int) -> None:
        """Takes note of a symbol that occurred."""
        self._counts[symbol] += GAIN
        self._since += GAIN
        if self._since * RENEWED > sum(self._counts):
            self._renew()


class Models:
    """Models of `constriction`, each built once."""

    def __init__(self) -> None:
        self._stream = load_constriction().stream
        self.uniform = self._stream.model.Uniform
        self.adaptive: dict[tuple[int, int], Adaptive] = {}
        self.tables: dict[int, Any] = {}

    def categorical(self, counts: np.ndarray):
        """Frequencies whose sum and partial sums float32 holds exactly."""
        return self._stream.model.Categorical(counts.astype(np.float32), perfect=False)

    def of_context(self, context: int, size: int) -> Adaptive:
        """The frequencies of a context, equal at first."""
        if (context, size) not in self.adaptive:
            self.adaptive[context, size] = Adaptive(size, self.categorical)
        return self.adaptive[context, size]

    def encoder(self):
        """A range encoder that starts empty."""
        return self._stream.queue.RangeEncoder()

    def decoder(self, words: np.ndarray):
        """A range decoder of (N,) uint32 words."""
        return self._stream.queue.RangeDecoder(words)


def by_class(classes: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """(class, (N,) places) of each class that occurs, ascending."""
    order = np.argsort(classes, kind="stable")
    keys, starts = np.unique(classes[order], return_index=True)
    return zip(keys.tolist(), np.split(order, starts[1:]))


def packed_tables(tables: Tables) -> bytes:
    """As they stand at the start of a group's stream."""
    mask = sum(1 << key for key in tables)
    return mask.to_bytes(CLASSES // 8, "little") + b"".join(bytes(value) for value in tables.values())


def unpacked_tables(data: bytes) -> tuple[Tables, bytes]:
    """The tables at the start of a group's stream, and what follows. Raises ValueError where that is cut off."""
    head = CLASSES // 8
    mask = int.from_bytes(data[:head], "little")
    keys = [key for key in range(CLASSES) if mask >> key & 1]
    end = head + PARAMETERS * len(keys)
    if len(data) < end or (len(data) - end) % WORD.itemsize:
        raise ValueError("the tables are cut off")
    return {key: tuple(data[head + PARAMETERS * i : head + PARAMETERS * (i + 1)]) for i, key in enumerate(keys)}, data[end:]  # type: ignore[misc]
