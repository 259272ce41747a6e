"""All elements and properties of a PLY file, text or binary (Turk 1994).

What a header declares is held against the bytes that are there before memory is taken for it.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field

import numpy as np

from ..core.geometry.ragged import ragged_indices

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_STRUCT = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I"}  # types that the length of a list may have
_HEADER = re.compile(rb"\s*ply[ \t]*(\r\n|\n|\r)(.*?)\bend_header[ \t]*\1", re.DOTALL)
_CUT_OFF = "it is truncated: it holds less than its header declares"


@dataclass(frozen=True)
class RaggedList:
    """Lists of different lengths.  values : end to end.  sizes : (N,) length of each."""

    values: np.ndarray
    sizes: np.ndarray


@dataclass(frozen=True)
class Ply:
    """elements : name -> property -> (N,) values, or a RaggedList.  comments : their texts.  types : "element property" -> numpy type."""

    elements: dict[str, dict[str, np.ndarray | RaggedList]]
    comments: tuple[str, ...]
    types: dict[str, str]


@dataclass
class _Element:
    name: str
    count: int
    properties: list[tuple[str, str, str]] = field(default_factory=list)  # name, type, type of the length of a list or ""

    @property
    def ragged(self) -> bool:
        return any(list_kind for _, _, list_kind in self.properties)


def parse_ply(data: bytes) -> Ply:
    """Raises ValueError, saying what is wrong, for what is not a PLY or ends too early."""
    header = _HEADER.match(data)
    if not header:
        raise ValueError("it has no PLY header; is it really a PLY file, or is it truncated?")
    lines = [line.strip() for line in header[2].decode("utf-8", "replace").splitlines()]
    elements = _declared(lines)
    stated = next((line.split()[1] for line in lines if line.startswith("format ") and len(line.split()) > 1), "")
    if stated == "ascii":
        source: _Text | _Binary = _Text(data[header.end() :])
    elif stated in ("binary_little_endian", "binary_big_endian"):
        source = _Binary(data, header.end(), "<" if "little" in stated else ">")
    else:
        raise ValueError(f"its format '{stated}' is none of PLY's three")
    comments = tuple(line.partition(" ")[2].strip() for line in lines if line.startswith("comment "))
    types = {f"{element.name} {name}": kind for element in elements for name, kind, _ in element.properties}
    return Ply({element.name: source.read(element) for element in elements if element.properties}, comments, types)


def _declared(lines: list[str]) -> list[_Element]:
    elements: list[_Element] = []
    for words in map(str.split, lines):
        if words[:1] == ["element"]:
            if len(words) != 3 or not re.fullmatch("[0-9]{1,18}", words[2]):
                raise ValueError(f"its header has an element without a count: '{' '.join(words)}'")
            elements.append(_Element(words[1], int(words[2])))
        elif words[:1] == ["property"] and elements:
            elements[-1].properties.append(_property(words))
    return elements


def _property(words: list[str]) -> tuple[str, str, str]:
    is_list = words[1:2] == ["list"]
    kinds = words[2:4] if is_list else words[1:2]
    known = len(words) == (5 if is_list else 3) and all(kind in _TYPES for kind in kinds)
    if not known or (is_list and _TYPES[kinds[0]] not in _STRUCT):
        raise ValueError(f"its header has a property that PLY does not know: '{' '.join(words)}'")
    return words[-1], _TYPES[kinds[-1]], _TYPES[kinds[0]] if is_list else ""


class _Text:
    """Reads elements one after the other from words; how they are broken into lines does not matter."""

    def __init__(self, body: bytes):
        self._words = body.split()
        self._at = 0

    def read(self, element: _Element) -> dict[str, np.ndarray | RaggedList]:
        if element.count * len(element.properties) > len(self._words) - self._at:  # a list is one word at least
            raise ValueError(_CUT_OFF)
        starts = self._starts(element) if element.ragged else self._equal_starts(element)
        result: dict[str, np.ndarray | RaggedList] = {}
        for (name, kind, list_kind), (first, sizes) in zip(element.properties, starts, strict=True):
            values = self._values(kind, first, sizes)
            result[name] = RaggedList(values, sizes) if list_kind else values
        return result

    def _equal_starts(self, element: _Element) -> list[tuple[np.ndarray, np.ndarray]]:
        width = len(element.properties)
        rows = self._at + width * np.arange(element.count)
        self._at += width * element.count
        return [(rows + column, np.ones(element.count, np.int64)) for column in range(width)]

    def _starts(self, element: _Element) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of each property: the first word and the number of words in each row."""
        firsts: list[list[int]] = [[] for _ in element.properties]
        sizes: list[list[int]] = [[] for _ in element.properties]
        at = self._at
        for _ in range(element.count):
            for (_, _, list_kind), first, size in zip(element.properties, firsts, sizes, strict=True):
                length = self._length(at) if list_kind else 1
                first.append(at + bool(list_kind))
                size.append(length)
                at = first[-1] + length
        if at > len(self._words):
            raise ValueError(_CUT_OFF)
        self._at = at
        return [(np.array(first, np.int64), np.array(size, np.int64)) for first, size in zip(firsts, sizes, strict=True)]

    def _length(self, at: int) -> int:
        if at >= len(self._words):
            raise ValueError(_CUT_OFF)
        word = self._words[at]
        if not re.fullmatch(rb"[0-9]{1,10}", word):
            raise ValueError(f"'{word[:20].decode('utf-8', 'replace')}' is not the length of a list")
        return int(word)

    def _values(self, kind: str, first: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        row, place = ragged_indices(sizes)
        words = self._words
        with np.errstate(invalid="ignore", over="ignore"):  # what does not fit its type is caught as an index that does not exist
            return np.array([words[at] for at in (first[row] + place).tolist()], dtype=np.float64).astype(kind)


class _Binary:
    """Reads elements one after the other from bytes."""

    def __init__(self, data: bytes, at: int, order: str):
        self._data, self._at, self._order = data, at, order

    def read(self, element: _Element) -> dict[str, np.ndarray | RaggedList]:
        smallest = sum(np.dtype(list_kind or kind).itemsize for _, kind, list_kind in element.properties)
        if element.count * smallest > len(self._data) - self._at:
            raise ValueError(_CUT_OFF)
        if not element.count:
            return {
                name: RaggedList(np.empty(0, kind), np.empty(0, np.int64)) if of else np.empty(0, kind)
                for name, kind, of in element.properties
            }
        equal = self._read_equal(element)
        return self._read_rows(element) if equal is None else equal

    def _read_equal(self, element: _Element) -> dict[str, np.ndarray | RaggedList] | None:
        """All rows at once, where every list is as long as in the first row; None otherwise."""
        fields: list[tuple] = []
        at = self._at
        for name, kind, list_kind in element.properties:
            size = self._length(list_kind, at) if list_kind else 1
            if list_kind:
                fields.append((f"size of {name}", self._order + list_kind))
            at += (np.dtype(list_kind).itemsize if list_kind else 0) + size * np.dtype(kind).itemsize
            if at > len(self._data):
                return None
            fields.append((name, self._order + kind, (size,)))
        row = _row_type(fields)
        if self._at + element.count * row.itemsize > len(self._data):
            return None
        rows = np.frombuffer(self._data, row, element.count, self._at)
        result: dict[str, np.ndarray | RaggedList] = {}
        for name, kind, list_kind in element.properties:
            values = np.ascontiguousarray(rows[name]).astype(kind).ravel()
            sizes = rows[f"size of {name}"].astype(np.int64) if list_kind else None
            if sizes is not None and (sizes != sizes[0]).any():
                return None
            result[name] = values if sizes is None else RaggedList(values, sizes)
        self._at += element.count * row.itemsize
        return result

    def _read_rows(self, element: _Element) -> dict[str, np.ndarray | RaggedList]:
        """Lists that differ in length: one pass finds where each row's values are, and another gathers them."""
        firsts: list[list[int]] = [[] for _ in element.properties]
        sizes: list[list[int]] = [[] for _ in element.properties]
        steps = [
            (np.dtype(kind).itemsize, list_kind, np.dtype(list_kind).itemsize if list_kind else 0)
            for _, kind, list_kind in element.properties
        ]
        at, end = self._at, len(self._data)
        for _ in range(element.count):
            for (width, list_kind, head), first, size in zip(steps, firsts, sizes, strict=True):
                length = self._length(list_kind, at) if list_kind else 1
                first.append(at + head)
                size.append(length)
                at += head + length * width
            if at > end:
                raise ValueError(_CUT_OFF)
        self._at = at
        result: dict[str, np.ndarray | RaggedList] = {}
        for (name, kind, list_kind), first, size in zip(element.properties, firsts, sizes, strict=True):
            lengths = np.array(size, np.int64)
            values = self._gathered(kind, np.array(first, np.int64), lengths)
            result[name] = RaggedList(values, lengths) if list_kind else values
        return result

    def _gathered(self, kind: str, first: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        width = np.dtype(kind).itemsize
        row, place = ragged_indices(sizes)
        starts = first[row] + place * width
        single = np.frombuffer(self._data, np.uint8)[starts[:, None] + np.arange(width)]
        return single.view(self._order + kind).ravel().astype(kind)

    def _length(self, kind: str, at: int) -> int:
        try:
            length = struct.unpack_from(self._order + _STRUCT[kind], self._data, at)[0]
        except struct.error:
            raise ValueError(_CUT_OFF) from None
        if length < 0:
            raise ValueError(f"a list has {length} values; the file is damaged")
        return length


def _row_type(fields: list[tuple]) -> np.dtype:
    names = [name for name, *_ in fields]
    if len(set(names)) < len(names):
        raise ValueError("its header names a property twice")
    return np.dtype(fields)
