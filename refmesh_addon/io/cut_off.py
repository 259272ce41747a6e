"""Finds the cut-off PLY, STL and OFF files that trimesh takes for whole or for empty ones."""

from __future__ import annotations

import re

_STL_HEADER, _STL_TRIANGLE = 84, 50  # bytes
_PLY_HEADER = re.compile(rb"\s*ply\s.*?\bend_header[ \t]*\r?\n", re.DOTALL)
_OFF_HEADER = re.compile(rb"\s*\w*OFF\s+([0-9]+)\s+([0-9]+)[^\n]*\n")


def check_complete(data: bytes, kind: str) -> None:
    """Raises ValueError, in words, when the file holds fewer elements than its head announces.

    kind : extension without the dot. Binary PLY and GLB are left to trimesh, which checks their lengths itself.
    """
    checks = {"ply": _check_ply, "stl": _check_stl, "off": _check_off}
    if kind in checks:
        checks[kind](data)


def _check_ply(data: bytes) -> None:
    header = _PLY_HEADER.match(data)
    if not header:
        raise ValueError("it has no PLY header; is it really a PLY file, or is it cut off?")
    if re.search(rb"^format\s+ascii", header[0], re.MULTILINE):
        elements = re.findall(rb"^element\s+(\w+)\s+([0-9]+)", header[0], re.MULTILINE)
        total = sum(int(count) for _, count in elements)
        _check_rows(data[header.end() :], total, ends_in_faces=bool(elements) and elements[-1][0] == b"face")


def _check_off(data: bytes) -> None:
    data = re.sub(rb"#[^\n]*", b"", data)
    header = _OFF_HEADER.match(data)
    if not header:
        raise ValueError("it has no OFF header; is it really an OFF file, or is it cut off?")
    _check_rows(data[header.end() :], int(header[1]) + int(header[2]), ends_in_faces=int(header[2]) > 0)


def _check_rows(body: bytes, stated: int, ends_in_faces: bool) -> None:
    """One row of text for each element; a face row starts with the number of its corners."""
    rows = [row for row in body.splitlines() if row.strip()]
    if len(rows) < stated:
        raise ValueError(f"it is cut off: its head announces {stated} rows of data, {len(rows)} are there")
    if ends_in_faces:
        words = rows[stated - 1].split()
        if len(words) <= int(words[0]):
            raise ValueError("it is cut off: its last face lacks corners")


def _check_stl(data: bytes) -> None:
    if len(data) >= _STL_HEADER:
        stated = _STL_HEADER + _STL_TRIANGLE * int.from_bytes(data[_STL_HEADER - 4 : _STL_HEADER], "little")
        if len(data) == stated:
            return
    text = data.lstrip()[:5].lower() == b"solid"
    if not text:
        raise ValueError("its length does not match its head; is it really an STL file, or is it cut off?")
    if b"endsolid" not in data[-1000:].lower():
        raise ValueError("it is cut off: 'endsolid' is missing")
