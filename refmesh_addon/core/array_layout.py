"""Shapes and types that arrays are declared with, written as in docstrings: "(V, 3) float64", or "(T, 3) int32 < V" for indices.

A letter stands for any length, the same wherever it occurs among the arrays of one result. A result type declares them with
`Annotated[np.ndarray, "(V, 3) float64"]`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

_DECLARED = re.compile(r"\((?P<shape>[^)]*)\) (?P<type>\w+)(?: < (?P<bound>\w+))?")
_KINDS = {"integer": "iu", "number": "iuf"}  # types whose width differs between systems or does not matter


class LayoutCheck:
    """Holds the arrays of one result against what they are declared as; remembers the length that each letter stands for."""

    def __init__(self) -> None:
        self._lengths: dict[str, int] = {}

    def check(self, name: str, array: np.ndarray, declared: str) -> None:
        """Raises ValueError, naming the array, where its shape, its type or, behind "<", its values are not as declared."""
        match = _DECLARED.fullmatch(declared)
        assert match, f"'{declared}' is not written like '(V, 3) float64'"
        expected = tuple(filter(None, (part.strip() for part in match["shape"].split(","))))
        if not (self._fits(array.shape, expected) and _is_of(array.dtype, match["type"])):
            raise ValueError(f"'{name}' is {array.shape} {array.dtype}, not {declared}")
        if match["bound"] and array.size and not 0 <= array.min() <= array.max() < self._lengths[match["bound"]]:
            raise ValueError(f"'{name}' holds indices that do not exist")

    def _fits(self, shape: tuple[int, ...], expected: tuple[str, ...]) -> bool:
        return len(shape) == len(expected) and all(
            length == (int(letter) if letter.isdigit() else self._lengths.setdefault(letter, length))
            for length, letter in zip(shape, expected)
        )


def check_layouts(arrays: Mapping[str, np.ndarray], declared: Mapping[str, str], optional: Mapping[str, str] | None = None) -> None:
    """Raises ValueError, naming the array, unless there are exactly the declared arrays, and any of the optional ones."""
    known, check = {**declared, **(optional or {})}, LayoutCheck()
    missing, foreign = sorted(declared.keys() - arrays.keys()), sorted(arrays.keys() - known.keys())
    if missing or foreign:
        raise ValueError(f"'{missing[0]}' is missing" if missing else f"'{foreign[0]}' is not known")
    for name, layout in known.items():
        if name in arrays:
            check.check(name, arrays[name], layout)


def _is_of(dtype: np.dtype, name: str) -> bool:
    return dtype.kind in _KINDS[name] if name in _KINDS else dtype.name == name
