"""Refuses truncated PLY, STL and OFF files that trimesh accepts as complete or as empty.

Each check raises ValueError when the file holds fewer elements than its header announces.
"""

from __future__ import annotations

import re

_STL_HEADER, _STL_TRIANGLE = 84, 50  # bytes
_PLY_HEADER = re.compile(rb"\s*ply\s.*?\bend_header[ \t]*\r?\n", re.DOTALL)
_OFF_HEADER = re.compile(rb"\s*\w*OFF\s+([0-9]+)\s+([0-9]+)[^\n]*\n")


def check_ply(data: bytes) -> None:
    """Of a PLY file in text form; the length of a binary one is checked by trimesh."""
    header = _PLY_HEADER.match(data)
    if not header:
        raise ValueError("it has no PLY header; is it really a PLY file, or is it truncated?")
    if re.search(rb"^format\s+ascii", header[0], re.MULTILINE):
        elements = re.findall(rb"^element\s+(\w+)\s+([0-9]+)", header[0], re.MULTILINE)
        total = sum(int(count) for _, count in elements)
        _check_rows(data[header.end() :], total, ends_in_faces=bool(elements) and elements[-1][0] == b"face")


def check_off(data: bytes) -> None:
    """Of an OFF file; comments and blank lines do not count."""
    data = re.sub(rb"#[^\n]*", b"", data)
    header = _OFF_HEADER.match(data)
    if not header:
        raise ValueError("it has no OFF header; is it really an OFF file, or is it truncated?")
    _check_rows(data[header.end() :], int(header[1]) + int(header[2]), ends_in_faces=int(header[2]) > 0)


def check_stl(data: bytes) -> None:
    """Of an STL file, binary or text."""
    if len(data) >= _STL_HEADER:
        stated = _STL_HEADER + _STL_TRIANGLE * int.from_bytes(data[_STL_HEADER - 4 : _STL_HEADER], "little")
        if len(data) == stated:
            return
    text = data.lstrip()[:5].lower() == b"solid"
    if not text:
        raise ValueError("its length does not match its header; is it really an STL file, or is it truncated?")
    if b"endsolid" not in data[-1000:].lower():
        raise ValueError("it is truncated: 'endsolid' is missing")


def _check_rows(body: bytes, stated: int, ends_in_faces: bool) -> None:
    """One row of text for each element; a face row starts with the number of its corners."""
    rows = [row for row in body.splitlines() if row.strip()]
    if len(rows) < stated:
        raise ValueError(f"it is truncated: its header announces {stated} rows of data, {len(rows)} are there")
    if ends_in_faces:
        numbers = rows[stated - 1].split()
        if len(numbers) <= int(numbers[0]):
            raise ValueError("it is truncated: its last face lacks corners")
