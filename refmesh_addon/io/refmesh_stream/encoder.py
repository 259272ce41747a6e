"""The writing end of a group's stream."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from ...core.compression.coder import LARGEST, Coder, frequencies, low_bits, table_parameters
from .entropy import ESCAPE_BITS, HALF_WORD, WORD, Models, Tables, by_class, packed_tables


class Encoder(Coder):
    """Takes everything down first, as tables are fitted to all of it, then codes it."""

    decoding = False

    def __init__(self) -> None:
        self._models = Models()
        self._steps: list[tuple] = []

    def integers(self, values: np.ndarray | None, classes: np.ndarray) -> np.ndarray:
        """Signed integers, N of them, in the classes given."""
        assert values is not None
        self._steps.append((values, classes))
        return values

    def choice(self, value: int | None, context: int, size: int) -> int:
        """One of `size` symbols."""
        assert value is not None
        self._steps.append((value, context, size))
        return value

    def number(self, value: int | None, bound: int) -> int:
        """One of range(bound)."""
        assert value is not None
        self._steps.append((value, bound, 0, 0))
        return value

    def finished(self) -> bytes:
        """The tables and everything that was coded."""
        tables = self._fitted_tables()
        self._models.tables = {key: self._models.categorical(frequencies(value)) for key, value in tables.items()}
        coder = self._models.encoder()
        for step in self._steps:
            if len(step) == 2:
                self._encode_integers(coder, *step)
            elif len(step) == 3:
                self._encode_choice(coder, *step)
            elif step[1] > 1:
                _encode_number(coder, self._models, step[0], step[1])
        words = coder.get_compressed()
        return packed_tables(tables) + words.astype(WORD).tobytes()

    def _fitted_tables(self) -> Tables:
        counts: dict[int, np.ndarray] = defaultdict(lambda: np.zeros(LARGEST + 2))
        for step in self._steps:
            if len(step) == 2:
                values, classes = step
                for key in np.unique(classes).tolist():
                    magnitudes = np.abs(values[classes == key]) >> low_bits(key)
                    counts[key] += np.bincount(np.minimum(magnitudes, LARGEST + 1), minlength=LARGEST + 2)
        return {key: table_parameters(counts[key]) for key in sorted(counts)}

    def _encode_integers(self, coder, values: np.ndarray, classes: np.ndarray) -> None:
        for key, chosen in by_class(classes):
            low = low_bits(key)
            own = values[chosen]
            high = np.sign(own) * (np.abs(own) >> low)
            coder.encode((np.clip(high, -LARGEST - 1, LARGEST + 1) + LARGEST + 1).astype(np.int32), self._models.tables[key])
            for value in high[np.abs(high) > LARGEST].tolist():
                _encode_escape(coder, self._models, abs(value) - LARGEST - 1)
            if low:
                coder.encode((np.abs(own) & ((1 << low) - 1)).astype(np.int32), self._models.uniform(1 << low))
                _encode_signs(coder, self._models, own[high == 0])

    def _encode_choice(self, coder, value: int, context: int, size: int) -> None:
        adaptive = self._models.of_context(context, size)
        coder.encode(value, adaptive.model)
        adaptive.count(value)


def _encode_number(coder, models: Models, value: int, bound: int) -> None:
    if bound > 1 << HALF_WORD:
        coder.encode(value >> HALF_WORD, models.uniform(((bound - 1) >> HALF_WORD) + 1))
        coder.encode(value & ((1 << HALF_WORD) - 1), models.uniform(1 << HALF_WORD))
    else:
        coder.encode(value, models.uniform(bound))


def _encode_escape(coder, models: Models, excess: int) -> None:
    """Exponential Golomb: how many bits, then the bits."""
    bits = (excess + 1).bit_length() - 1
    coder.encode(bits, models.uniform(1 << ESCAPE_BITS))
    if bits:
        _encode_number(coder, models, excess + 1 - (1 << bits), 1 << bits)


def _encode_signs(coder, models: Models, values: np.ndarray) -> None:
    """Of values whose high part is 0, which tells no sign."""
    values = values[values != 0]
    if len(values):
        coder.encode((values < 0).astype(np.int32), models.uniform(2))
