"""Triangles of an STL file, binary or text."""

from __future__ import annotations

import re

import numpy as np

from .polygons import ParsedMesh

_HEADER = 84  # bytes, the last four of which are the number of triangles
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_FACET_END = re.compile(rb"\bendfacet\b", re.IGNORECASE)


def parse_stl(data: bytes) -> ParsedMesh:
    """Three vertices for each triangle, in the order of the file.

    A few bytes after the last triangle are ignored, as is padding with zeros or blanks.
    Raises ValueError, saying what is wrong, for what is not an STL or ends too early.
    """
    corners = _text(data) if _stated(data) is None else _binary(data)
    return ParsedMesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def _stated(data: bytes) -> int | None:
    """The triangles that a binary file declares; None for a text file. Many binary files begin with "solid" too."""
    count = int.from_bytes(data[_HEADER - 4 : _HEADER], "little") if len(data) >= _HEADER else -1
    text = data.lstrip()[:5].lower() == b"solid"
    complete = 0 <= count <= (len(data) - _HEADER) // _TRIANGLE.itemsize
    return None if text and (not complete or b"\0" not in data) else count


def _binary(data: bytes) -> np.ndarray:
    count = _stated(data)
    if count is None or count < 0:
        raise ValueError("its length does not match its header; is it really an STL file, or is it truncated?")
    length = _HEADER + count * _TRIANGLE.itemsize
    if length > len(data):
        raise ValueError(
            f"its length does not match its header, which declares {count} triangles; is it really an STL file, or is it truncated?"
        )
    rest = data[length:]
    if len(rest) >= _TRIANGLE.itemsize and rest.strip(b"\0 \r\n"):
        raise ValueError(f"its length does not match its header: {len(rest)} bytes follow the {count} triangles that it declares")
    return np.frombuffer(data, _TRIANGLE, count, _HEADER)["corners"].astype(np.float64)


def _text(data: bytes) -> np.ndarray:
    if b"endsolid" not in data[-1000:].lower():
        raise ValueError("it is truncated: 'endsolid' is missing")
    words = _VERTEX.findall(data)
    facets = len(_FACET_END.findall(data))
    if len(words) != 3 * facets:
        raise ValueError(f"its {facets} facets have {len(words)} vertices; is it truncated?")
    return np.array(words, dtype=np.float64).reshape(-1, 3, 3)
