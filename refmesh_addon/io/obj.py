"""Geometry of a Wavefront OBJ file.

Our own reader because trimesh splits vertices along UV seams and material borders, reorders them, and lets truncated files pass.
"""

from __future__ import annotations

import re

import numpy as np

# Open3D and MeshLab state the number of faces in a comment at the top of a file.
_STATED_FACES = re.compile(rb"#\s*(?:number of triangles|faces)\s*:\s*([0-9]+)\s*$", re.IGNORECASE)
# Share of vertices without a face above which a file that ends inside a line is taken to be truncated.
CUT_OFF_UNUSED = 0.02
_ATTRIBUTE_INDICES = re.compile(rb"/\S*")


def parse_obj(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) float64 in the order of the file and triangles (T, 3) int64; polygons become fans.

    All objects and groups are taken together; normals, texture coordinates and materials are ignored.
    Raises ValueError, with the line number, for a file that is not an OBJ or ends too early.
    """
    lines = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines()
    vertex_lines, face_lines, vertices_before = [], [], []
    for number, line in enumerate(lines, start=1):
        keyword = line.lstrip()[:2]
        if keyword in (b"v ", b"v\t"):
            vertex_lines.append(number)
        elif keyword in (b"f ", b"f\t", b"f"):
            face_lines.append(number)
            vertices_before.append(len(vertex_lines))
    if not vertex_lines:
        raise ValueError("it holds no vertices; is it really an OBJ file?")
    vertices = _parse_vertices(lines, vertex_lines)
    corners, sizes = _parse_faces(lines, face_lines)
    corners = _absolute(corners, np.repeat(np.array(vertices_before, dtype=np.int64), sizes))
    _check_complete(data, lines, len(vertices), corners, len(sizes))
    return vertices, fan(corners, sizes)


def fan(corners: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Triangles (T, 3) of polygons given by their corners one after the other and the number of corners of each."""
    starts = np.cumsum(sizes) - sizes
    per_polygon = sizes - 2
    first = np.repeat(starts, per_polygon)
    step = np.arange(per_polygon.sum()) - np.repeat(np.cumsum(per_polygon) - per_polygon, per_polygon)
    return corners[np.column_stack([first, first + step + 1, first + step + 2])]


def _parse_vertices(lines: list[bytes], numbers: list[int]) -> np.ndarray:
    try:
        return np.loadtxt([lines[number - 1] for number in numbers], usecols=(1, 2, 3), ndmin=2, encoding="latin-1")
    except ValueError:
        for number in numbers:
            _check_vertex(lines[number - 1], number)
        raise


def _check_vertex(line: bytes, number: int) -> None:
    numbers = line.split(b"#")[0].split()[1:4]
    try:
        complete = len([float(number) for number in numbers]) == 3
    except ValueError:
        complete = False
    if not complete:
        raise ValueError(f"line {number} is not a vertex with three coordinates: '{_shown(line)}'")


def _parse_faces(lines: list[bytes], numbers: list[int]) -> tuple[np.ndarray, np.ndarray]:
    faces = [_ATTRIBUTE_INDICES.sub(b"", lines[number - 1].partition(b"#")[0]).split()[1:] for number in numbers]
    sizes = np.array([len(face) for face in faces], dtype=np.int64)
    try:
        corners = np.array([int(corner) for face in faces for corner in face], dtype=np.int64)
    except (ValueError, OverflowError):
        number = next(number for number, face in zip(numbers, faces, strict=True) if not all(map(_is_index, face)))
        raise ValueError(f"line {number} is not a face: '{_shown(lines[number - 1])}'") from None
    if (sizes < 3).any():
        number = numbers[int(np.argmax(sizes < 3))]
        raise ValueError(f"line {number} is a face with fewer than three corners: '{_shown(lines[number - 1])}'; is the file truncated?")
    return corners, sizes


def _is_index(word: bytes) -> bool:
    return re.fullmatch(rb"-?[0-9]{1,18}", word) is not None


def _absolute(corners: np.ndarray, vertices_before: np.ndarray) -> np.ndarray:
    """Indices from 0; negative ones count back from the vertices read so far; 0, which OBJ does not allow, becomes -1."""
    return np.where(corners >= 0, corners - 1, np.where(vertices_before + corners < 0, -1, vertices_before + corners))


def _check_complete(data: bytes, lines: list[bytes], vertices: int, corners: np.ndarray, faces: int) -> None:
    stated = _stated_faces(lines)
    if stated is not None and faces < stated:
        raise ValueError(f"it is truncated: its header announces {stated} faces, {faces} are there")
    # Either sign alone occurs in intact files; a file truncated in the middle of its faces shows both.
    ends_inside_line = not data.endswith((b"\n", b"\r"))
    unused = vertices - len(np.unique(corners))
    if ends_inside_line and faces and unused > CUT_OFF_UNUSED * vertices:
        raise ValueError(f"it seems truncated: no face uses {unused} of its {vertices} vertices; if it is whole, end it with a line break")


def _stated_faces(lines: list[bytes]) -> int | None:
    for line in lines:
        if line.strip() and not line.startswith(b"#"):
            return None
        if match := _STATED_FACES.match(line):
            return int(match[1])
    return None


def _shown(line: bytes) -> str:
    text = line.strip().decode("utf-8", "replace")
    return text if len(text) <= 40 else text[:37] + "..."
