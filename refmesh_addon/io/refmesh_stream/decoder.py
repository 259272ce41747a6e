"""The reading end of a group's stream."""

from __future__ import annotations

import numpy as np

from ...core.compression.coder import LARGEST, Coder, frequencies, low_bits
from .entropy import ESCAPE_BITS, HALF_WORD, WORD, Models, by_class, unpacked_tables


class Decoder(Coder):
    """Gives back what `Encoder.finished` holds. Raises ValueError where that is not it."""

    decoding = True

    def __init__(self, data: bytes):
        self._models = Models()
        tables, rest = unpacked_tables(data)
        self._models.tables = {key: self._models.categorical(frequencies(value)) for key, value in tables.items()}
        self._coder = self._models.decoder(np.frombuffer(rest, WORD).astype(np.uint32))

    def integers(self, values: np.ndarray | None, classes: np.ndarray) -> np.ndarray:
        """Signed integers, N of them, in the classes given."""
        result = np.empty(len(classes), dtype=np.int64)
        for key, chosen in by_class(classes):
            if key not in self._models.tables:
                raise ValueError(f"there is no table for class {key}")
            result[chosen] = self._decoded_class(key, len(chosen))
        return result

    def _decoded_class(self, key: int, count: int) -> np.ndarray:
        low = low_bits(key)
        high = self._decoded(self._models.tables[key], count) - (LARGEST + 1)
        for place in np.flatnonzero(np.abs(high) > LARGEST).tolist():
            high[place] = np.sign(high[place]) * (self._decoded_escape() + LARGEST + 1)
        if not low:
            return high
        rest = self._decoded(self._models.uniform(1 << low), count)
        signs = np.sign(high)
        doubtful = np.flatnonzero((high == 0) & (rest != 0))
        if len(doubtful):
            signs[doubtful] = 1 - 2 * self._decoded(self._models.uniform(2), len(doubtful))
        return signs * ((np.abs(high) << low) + rest)

    def _decoded(self, model, count: int) -> np.ndarray:
        return self._guarded(model, count).astype(np.int64)

    def _guarded(self, model, *count):
        try:
            return self._coder.decode(model, *count)
        except AssertionError as error:
            raise ValueError("the coded data are not valid") from error

    def _decoded_escape(self) -> int:
        bits = self._guarded(self._models.uniform(1 << ESCAPE_BITS))
        return (1 << bits) - 1 + (self.number(None, 1 << bits) if bits else 0)

    def choice(self, value: int | None, context: int, size: int) -> int:
        """One of `size` symbols."""
        adaptive = self._models.of_context(context, size)
        symbol = self._guarded(adaptive.model)
        adaptive.count(symbol)
        return symbol

    def number(self, value: int | None, bound: int) -> int:
        """One of range(bound)."""
        if bound <= 1:
            return 0
        if bound <= 1 << HALF_WORD:
            return self._guarded(self._models.uniform(bound))
        high = self._guarded(self._models.uniform(((bound - 1) >> HALF_WORD) + 1))
        result = (high << HALF_WORD) + self._guarded(self._models.uniform(1 << HALF_WORD))
        if result >= bound:
            raise ValueError("a number is beyond its bound")
        return result
