"""Colours and velocities of vertices, from binary PLY files such as `write_ply` writes, read in a millisecond."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.check import RefMeshError

END = b"end_header\n"
CHANNELS = ("red", "green", "blue", "alpha")
AXES = ("vx", "vy", "vz")
_KINDS = {"double": "<f8", "float": "<f4", "int": "<i4", "uint": "<u4", "short": "<i2", "ushort": "<u2", "char": "i1", "uchar": "u1"}


def read_colors(path: str | Path) -> np.ndarray:
    """(V, 4) uint8. Raises RefMeshError when the file is missing, cut off, or has no such colours."""
    return _columns(path, CHANNELS, "colours", "run Measure Distance")


def read_velocities(path: str | Path) -> np.ndarray:
    """(V, 3) float32, scene units per frame. Raises RefMeshError when the file is missing, cut off, or has no velocities."""
    return _columns(path, AXES, "velocities", "run the Deform step")


def _columns(path: str | Path, names: tuple[str, ...], words: str, remedy: str) -> np.ndarray:
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise RefMeshError(f"{path}: cannot be read ({error.strerror or error}); {remedy} again") from error
    head, _, body = data.partition(END)
    count, row = _vertices(head.decode("ascii", "replace").splitlines())
    if not set(names) <= set(row.names or ()) or len(body) < count * row.itemsize:
        raise RefMeshError(f"{path}: holds no {words}; {remedy} first")
    rows = np.frombuffer(body, row, count)
    return np.stack([rows[name] for name in names], axis=1)


def _vertices(lines: list[str]) -> tuple[int, np.dtype]:
    """Number of vertices and what is stored of each, which comes first in the file."""
    words = [line.split() for line in lines]
    elements = [index for index, line in enumerate(words) if line[:1] == ["element"]]
    if not elements or "binary_little_endian" not in lines[1] or words[elements[0]][1] != "vertex":
        return 0, np.dtype([])
    own = [line for line in words[elements[0] + 1 : (elements + [len(words)])[1]] if line[0] == "property"]
    return int(words[elements[0]][2]), np.dtype([(line[-1], _KINDS[line[1]]) for line in own])
