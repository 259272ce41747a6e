"""Binary PLY files of results: written with colors and velocities, and read back in milliseconds with numpy alone.

Files of other programs, in any form of PLY, are read by `io.meshes`.
"""

from __future__ import annotations

import re
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core.errors import RefMeshError
from ..core.types import TriangleMesh
from .files import atomic_file
from .regular_files import read_regular


class _Columns(NamedTuple):
    """Properties of a vertex that are stored one after the other in one type."""

    names: tuple[str, ...]
    ply_type: str
    dtype: str


POSITION = _Columns(("x", "y", "z"), "double", "<f8")  # single precision is too coarse far from the origin
COLOR = _Columns(("red", "green", "blue", "alpha"), "uchar", "u1")
VELOCITY = _Columns(("vx", "vy", "vz"), "float", "<f4")
VISIBILITY = _Columns(("visibility",), "float", "<f4")
FACE = np.dtype([("corners", "u1"), ("indices", "<i4", 3)])
FACE_PROPERTY = "property list uchar int vertex_indices"
FORMAT, END = "format binary_little_endian 1.0", b"end_header\n"
DTYPES = {columns.ply_type: columns.dtype for columns in (POSITION, COLOR, VELOCITY, VISIBILITY)}


def write_ply(
    path: str | Path,
    mesh: TriangleMesh,
    colors: np.ndarray | None = None,
    velocities: np.ndarray | None = None,
    comment: str = "",
    visibility: np.ndarray | None = None,
) -> None:
    """Writes vertices and triangles in their order; the same mesh gives the same bytes.

    colors : (V, 4) uint8, red, green, blue and alpha of each vertex.
    velocities : (V, 3), scene units per frame, stored as float32 vx, vy and vz.
    comment : one line for the header.  visibility : (V,) 0 to 1, stored as a float32 property of that name.
    Raises RefMeshError when the file cannot be written.
    """
    count = len(mesh.vertices)
    if colors is not None and (colors.shape != (count, 4) or colors.dtype != np.uint8):
        raise ValueError(f"colors must be ({count}, 4) uint8; got {colors.shape} {colors.dtype}")
    if velocities is not None and velocities.shape != (count, 3):
        raise ValueError(f"velocities must be ({count}, 3); got {velocities.shape}")
    if visibility is not None and visibility.shape != (count,):
        raise ValueError(f"visibility must be ({count},); got {visibility.shape}")
    column = None if visibility is None else visibility[:, None]
    table = [(POSITION, mesh.vertices), (COLOR, colors), (VELOCITY, velocities), (VISIBILITY, column)]
    stored = [(columns, values) for columns, values in table if values is not None]
    rows = np.empty(count, dtype=[(columns.names[0], columns.dtype, (len(columns.names),)) for columns, _ in stored])
    for columns, values in stored:
        rows[columns.names[0]] = values
    faces = np.empty(len(mesh.triangles), dtype=FACE)
    faces["corners"], faces["indices"] = 3, mesh.triangles
    with atomic_file(path) as file:
        file.write(_header([columns for columns, _ in stored], count, len(faces), comment))
        file.write(rows.tobytes())
        file.write(faces.tobytes())


def read_colors(path: str | Path) -> np.ndarray:
    """(V, 4) uint8. Raises RefMeshError when the file is missing, truncated, or has no colors that `write_ply` wrote."""
    return _read_columns(path, COLOR, "colors", "run Measure Distance")


def read_velocities(path: str | Path) -> np.ndarray:
    """(V, 3) float32, scene units per frame. Raises RefMeshError when the file is missing, truncated, or has no velocities."""
    return _read_columns(path, VELOCITY, "velocities", "run the Deform step")


def read_visibility(path: str | Path) -> np.ndarray:
    """(V,) float32, 0 to 1. Raises RefMeshError when the file is missing, truncated, or has no visibility, as frames of closed takes."""
    return _read_columns(path, VISIBILITY, "visibility", "run the Deform step on an open take").reshape(-1)


def read_surface(path: str | Path) -> TriangleMesh:
    """Vertices and triangles. Raises RefMeshError when the file is missing, truncated, or was not written by `write_ply`."""
    rows, rest = _read(path, "run the steps again")
    complete = set(POSITION.names) <= set(rows.dtype.names or ()) and len(rest) and len(rest) % FACE.itemsize == 0
    faces = np.frombuffer(rest, FACE) if complete else np.empty(0, FACE)
    indices = faces["indices"]
    if not len(faces) or (faces["corners"] != 3).any() or indices.min() < 0 or indices.max() >= len(rows):
        raise RefMeshError(f"{path}: is damaged or was not written by RefMesh; run the steps again")
    return TriangleMesh(np.stack([rows[axis] for axis in POSITION.names], axis=1), indices)


def replace_positions(path: str | Path, positions: np.ndarray) -> None:
    """Moves the vertices in a file that `write_ply` wrote to (V, 3) positions; all else in it stays.

    Raises RefMeshError when the file has another number of vertices or cannot be written.
    """
    rows, faces = _read(path, "run the steps again")
    if len(rows) != len(positions) or not set(POSITION.names) <= set(rows.dtype.names or ()):
        raise RefMeshError(f"{path}: does not hold {len(positions)} vertices; run the Deform step again")
    moved = rows.copy()
    for axis, values in zip(POSITION.names, positions.T):
        moved[axis] = values
    header = read_regular(path).partition(END)[0]
    with atomic_file(path) as file:
        file.write(header + END + moved.tobytes() + faces)


def _header(stored: list[_Columns], vertices: int, faces: int, comment: str) -> bytes:
    lines = ["ply", FORMAT, f"element vertex {vertices}"]
    lines += [f"property {columns.ply_type} {name}" for columns in stored for name in columns.names]
    lines += [f"element face {faces}", FACE_PROPERTY, *([f"comment {comment}"] if comment else []), ""]
    return "\n".join(lines).encode("ascii") + END


def _read_columns(path: str | Path, columns: _Columns, meaning: str, remedy: str) -> np.ndarray:
    rows, _ = _read(path, f"{remedy} again")
    if not set(columns.names) <= set(rows.dtype.names or ()):
        raise RefMeshError(f"{path}: holds no {meaning}; {remedy} first")
    return np.stack([rows[name] for name in columns.names], axis=1)


def _read(path: str | Path, remedy: str) -> tuple[np.ndarray, bytes]:
    """What is stored of each vertex, nothing where the file is truncated, and the bytes that follow."""
    try:
        data = read_regular(path)
    except OSError as error:
        raise RefMeshError(f"{path}: cannot be read ({error.strerror or error}); {remedy}") from error
    header, _, body = data.partition(END)
    count, row = _vertex_layout(header.decode("ascii", "replace").splitlines())
    if not row.itemsize or len(body) < count * row.itemsize:
        return np.empty(0, [("nothing", "u1")]), b""
    return np.frombuffer(body, row, count), body[count * row.itemsize :]


def _vertex_layout(lines: list[str]) -> tuple[int, np.dtype]:
    """Number of vertices and the layout of each; (0, no fields) for a file that `write_ply` did not write."""
    vertices = re.fullmatch("element vertex ([0-9]+)", lines[2]) if lines[1:2] == [FORMAT] and len(lines) > 2 else None
    if not vertices:
        return 0, np.dtype([])
    properties = takewhile(bool, (re.fullmatch(r"property (\w+) (\w+)", line) for line in lines[3:]))
    stored = [(declared[2], DTYPES.get(declared[1])) for declared in properties if declared]
    if not all(dtype for _, dtype in stored) or len({name for name, _ in stored}) < len(stored):
        return 0, np.dtype([])
    return int(vertices[1]), np.dtype(stored)
