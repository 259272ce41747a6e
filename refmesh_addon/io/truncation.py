"""Refuses truncated OFF files, which trimesh accepts as complete or as empty."""

from __future__ import annotations

import re

_OFF_HEADER = re.compile(rb"\s*\w*OFF\s+([0-9]+)\s+([0-9]+)[^\n]*\n")


def check_off(data: bytes) -> None:
    """Raises ValueError when the file holds fewer elements than its header declares; comments and blank lines do not count."""
    data = re.sub(rb"#[^\n]*", b"", data)
    header = _OFF_HEADER.match(data)
    if not header:
        raise ValueError("it has no OFF header; is it really an OFF file, or is it truncated?")
    _check_rows(data[header.end() :], int(header[1]) + int(header[2]), ends_in_faces=int(header[2]) > 0)


def _check_rows(body: bytes, stated: int, ends_in_faces: bool) -> None:
    """One row of text for each element; a face row starts with the number of its corners."""
    rows = [row for row in body.splitlines() if row.strip()]
    if len(rows) < stated:
        raise ValueError(f"it is truncated: its header declares {stated} rows of data, {len(rows)} are there")
    if ends_in_faces:
        numbers = rows[stated - 1].split()
        if len(numbers) <= int(numbers[0]):
            raise ValueError("it is truncated: its last face lacks corners")
