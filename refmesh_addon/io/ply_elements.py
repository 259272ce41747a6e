"""All elements and properties of a PLY file, text or binary (Turk 1994)."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

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
_HEADER = re.compile(rb"\s*ply[ \t]*\r?\n(.*?)\bend_header[ \t]*\r?\n", re.DOTALL)


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


def parse_ply(data: bytes) -> Ply:
    """Raises ValueError, in words, for what is not a PLY or ends too early."""
    header = _HEADER.match(data)
    if not header:
        raise ValueError("it has no PLY header; is it really a PLY file?")
    lines = [line.strip() for line in header[1].decode("utf-8", "replace").splitlines()]
    elements = _declared(lines)
    stated = next((line.split()[1] for line in lines if line.startswith("format ")), "")
    if stated == "ascii":
        source: _Source = _Text(data[header.end() :])
    elif stated in ("binary_little_endian", "binary_big_endian"):
        source = _Binary(data, header.end(), "<" if "little" in stated else ">")
    else:
        raise ValueError(f"its format '{stated}' is none of PLY's three")
    comments = tuple(line.partition(" ")[2].strip() for line in lines if line.startswith("comment "))
    types = {f"{element.name} {name}": kind for element in elements for name, kind, _ in element.properties}
    try:
        return Ply({element.name: source.read(element) for element in elements}, comments, types)
    except (IndexError, ValueError) as error:
        raise ValueError("it is cut off: it holds less than its header announces") from error


def _declared(lines: list[str]) -> list[_Element]:
    elements: list[_Element] = []
    for words in map(str.split, lines):
        if words[:1] == ["element"] and len(words) == 3 and words[2].isdigit():
            elements.append(_Element(words[1], int(words[2])))
        elif words[:1] == ["property"] and elements:
            is_list = words[1:2] == ["list"]
            kinds = words[2:4] if is_list else words[1:2]
            if len(words) != (5 if is_list else 3) or not all(kind in _TYPES for kind in kinds):
                raise ValueError(f"its header has a property that PLY does not know: '{' '.join(words)}'")
            elements[-1].properties.append((words[-1], _TYPES[kinds[-1]], _TYPES[kinds[0]] if is_list else ""))
    return elements


class _Source:
    """Reads the elements of a body one after the other."""

    def read(self, element: _Element) -> dict[str, np.ndarray | RaggedList]:
        raise NotImplementedError


class _Text(_Source):
    def __init__(self, body: bytes):
        self._lines = [line for line in body.splitlines() if line.strip()]
        self._at = 0

    def read(self, element: _Element) -> dict[str, np.ndarray | RaggedList]:
        rows = [line.split() for line in self._lines[self._at : self._at + element.count]]
        if len(rows) < element.count:
            raise IndexError
        self._at += element.count
        result: dict[str, np.ndarray | RaggedList] = {}
        starts = [0] * len(rows)
        for name, kind, list_kind in element.properties:
            sizes = [int(row[start]) for row, start in zip(rows, starts)] if list_kind else [1] * len(rows)
            first = [start + 1 for start in starts] if list_kind else starts
            words = [word for row, start, size in zip(rows, first, sizes) for word in _slice(row, start, size)]
            values = np.array(words, dtype=np.float64).astype(kind) if words else np.empty(0, kind)
            result[name] = RaggedList(values, np.array(sizes, dtype=np.int64)) if list_kind else values
            starts = [start + size for start, size in zip(first, sizes)]
        return result


def _slice(row: list[bytes], start: int, size: int) -> list[bytes]:
    if start + size > len(row):
        raise IndexError
    return row[start : start + size]


class _Binary(_Source):
    def __init__(self, data: bytes, at: int, order: str):
        self._data, self._at, self._order = data, at, order

    def read(self, element: _Element) -> dict[str, np.ndarray | RaggedList]:
        return self._read_equal(element) or self._read_rows(element)

    def _read_equal(self, element: _Element) -> dict[str, np.ndarray | RaggedList] | None:
        """All rows at once, where every list is as long as in the first row; None otherwise."""
        fields: list[tuple] = []
        at = self._at
        for name, kind, list_kind in element.properties if element.count else []:
            size = 1
            if list_kind:
                size = int(self._value(list_kind, at))
                fields.append((f"{name} size", self._order + list_kind))
                at += np.dtype(list_kind).itemsize
            fields.append((name, self._order + kind, (size,)))
            at += size * np.dtype(kind).itemsize
        row = np.dtype(fields)
        if self._at + element.count * row.itemsize > len(self._data):
            return None
        rows = np.frombuffer(self._data, row, element.count, self._at) if element.count else np.empty(0, row)
        result: dict[str, np.ndarray | RaggedList] = {}
        for name, kind, list_kind in element.properties:
            values = np.ascontiguousarray(rows[name]).astype(kind).ravel() if element.count else np.empty(0, kind)
            if list_kind and element.count and (rows[f"{name} size"] != rows[f"{name} size"][0]).any():
                return None
            sizes = rows[f"{name} size"].astype(np.int64) if list_kind and element.count else np.empty(0, np.int64)
            result[name] = RaggedList(values, sizes) if list_kind else values
        self._at += element.count * row.itemsize
        return result

    def _read_rows(self, element: _Element) -> dict[str, np.ndarray | RaggedList]:
        """Row by row, where lists differ in length."""
        parts: dict[str, list[np.ndarray]] = {name: [] for name, _, _ in element.properties}
        for _ in range(element.count):
            for name, kind, list_kind in element.properties:
                size = int(self._value(list_kind, self._at)) if list_kind else 1
                self._at += np.dtype(list_kind).itemsize if list_kind else 0
                parts[name].append(np.frombuffer(self._data, self._order + kind, size, self._at))
                self._at += size * np.dtype(kind).itemsize
        return {
            name: RaggedList(np.concatenate(parts[name]).astype(kind), np.array([len(part) for part in parts[name]]))
            if list_kind
            else np.concatenate(parts[name]).astype(kind)
            for name, kind, list_kind in element.properties
        }

    def _value(self, kind: str, at: int) -> np.ndarray:
        return np.frombuffer(self._data, self._order + kind, 1, at)[0]
