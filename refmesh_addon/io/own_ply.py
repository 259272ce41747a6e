"""Binary PLY files such as `write_ply` writes, read in milliseconds with nothing but numpy, while a window waits."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.errors import RefMeshError
from ..core.types import TriangleMesh

END = b"end_header\n"
FACE = np.dtype([("corners", "u1"), ("indices", "<i4", 3)])
CHANNELS = ("red", "green", "blue", "alpha")
AXES = ("vx", "vy", "vz")
_KINDS = {"double": "<f8", "float": "<f4", "int": "<i4", "uint": "<u4", "short": "<i2", "ushort": "<u2", "char": "i1", "uchar": "u1"}


def read_colors(path: str | Path) -> np.ndarray:
    """(V, 4) uint8. Raises RefMeshError when the file is missing, cut off, or has no such colours."""
    return _columns(path, CHANNELS, "colours", "run Measure Distance")


def read_velocities(path: str | Path) -> np.ndarray:
    """(V, 3) float32, scene units per frame. Raises RefMeshError when the file is missing, cut off, or has no velocities."""
    return _columns(path, AXES, "velocities", "run the Deform step")


def read_surface(path: str | Path) -> TriangleMesh:
    """Vertices and triangles. Raises RefMeshError when the file is missing, cut off, or not one of ours."""
    rows, rest = _read(path, "run the steps again")
    whole = {"x", "y", "z"} <= set(rows.dtype.names or ()) and len(rest) and len(rest) % FACE.itemsize == 0
    faces = np.frombuffer(rest, FACE) if whole else np.empty(0, FACE)
    indices = faces["indices"]
    if not len(faces) or (faces["corners"] != 3).any() or indices.min() < 0 or indices.max() >= len(rows):
        raise RefMeshError(f"{path}: is damaged or was not written by RefMesh; run the steps again")
    return TriangleMesh(np.stack([rows[axis] for axis in "xyz"], axis=1), indices)


def _columns(path: str | Path, names: tuple[str, ...], words: str, remedy: str) -> np.ndarray:
    rows, _ = _read(path, f"{remedy} again")
    if not set(names) <= set(rows.dtype.names or ()):
        raise RefMeshError(f"{path}: holds no {words}; {remedy} first")
    return np.stack([rows[name] for name in names], axis=1)


def _read(path: str | Path, remedy: str) -> tuple[np.ndarray, bytes]:
    """What is stored of each vertex, none where the file is cut off, and the bytes behind."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise RefMeshError(f"{path}: cannot be read ({error.strerror or error}); {remedy}") from error
    head, _, body = data.partition(END)
    count, row = _vertices(head.decode("ascii", "replace").splitlines())
    if not row.itemsize or len(body) < count * row.itemsize:
        return np.empty(0, [("nothing", "u1")]), b""
    return np.frombuffer(body, row, count), body[count * row.itemsize :]


def _vertices(lines: list[str]) -> tuple[int, np.dtype]:
    """Number of vertices and what is stored of each, which comes first in the file."""
    words = [line.split() for line in lines]
    elements = [index for index, line in enumerate(words) if line[:1] == ["element"]]
    if not elements or len(lines) < 2 or "binary_little_endian" not in lines[1] or words[elements[0]][1] != "vertex":
        return 0, np.dtype([])
    own = [line for line in words[elements[0] + 1 : (elements + [len(words)])[1]] if line[0] == "property"]
    return int(words[elements[0]][2]), np.dtype([(line[-1], _KINDS[line[1]]) for line in own])
