"""Geometry of a Wavefront OBJ file.

Our own reader because trimesh splits vertices along UV seams and material borders, reorders them, and lets truncated files pass.
"""

from __future__ import annotations

import codecs
import re

import numpy as np

from .polygons import ParsedMesh, fan

# Open3D and MeshLab state the number of faces in a comment at the top of a file.
_STATED_FACES = re.compile(rb"#\s*(?:number of triangles|faces)\s*:\s*([0-9]+)\s*$", re.IGNORECASE)
# Share of vertices without a face above which a file that ends inside a line is taken to be truncated.
CUT_OFF_UNUSED = 0.02
_ATTRIBUTE_INDICES = re.compile(rb"/\S*")


def parse_obj(data: bytes) -> ParsedMesh:
    """Vertices in the order of the file, and triangles; polygons become fans, faces of one or two corners are left out.

    All objects and groups are taken together; points, lines, normals, texture coordinates and materials are ignored.
    Raises ValueError, with the line number, for a file that is not an OBJ or ends too early.
    """
    lines = obj_lines(data)
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
    ends_inside_line = not data.rstrip(b"\0").endswith((b"\n", b"\r"))  # the zeros are those of UTF-16
    if ends_inside_line and len(sizes) and sizes[-1] < 3 and face_lines[-1] == len(lines):
        raise ValueError(
            f"line {len(lines)}, the last, is a face with fewer than three corners: '{_shown(lines[-1])}'; is the file truncated?"
        )
    _check_complete(ends_inside_line, lines, len(vertices), corners, len(sizes))
    return ParsedMesh(vertices, fan(corners, sizes), int(np.count_nonzero(sizes < 3)))


def obj_lines(data: bytes) -> list[bytes]:
    """The lines of an OBJ without byte-order mark. A continued line stands where it begins, with empty lines in place of the others.

    Blanks may follow the backslash; a comment that ends with one, as a path on Windows does, is not continued.
    Raises ValueError for UTF-16 that cannot be decoded.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        data = data.decode("utf-16").encode()
    lines = data.removeprefix(codecs.BOM_UTF8).splitlines()
    return _joined(lines) if b"\\" in data else lines


def library_names(lines: list[bytes]) -> list[str]:
    """The material libraries that the lines of an OBJ name, each once, with forward slashes."""
    words = (line.split(None, 1) for line in lines if line.lstrip()[:6].lower() == b"mtllib")
    names = (rest[0].decode("utf-8", "replace").strip().replace("\\", "/") for _, *rest in words if rest)
    return list(dict.fromkeys(names))


def _joined(lines: list[bytes]) -> list[bytes]:
    joined: list[bytes] = []
    parts: list[bytes] = []
    for line in lines:
        parts.append(line)
        comment = parts[0].lstrip().startswith(b"#")
        if comment or not line.rstrip().endswith(b"\\"):
            joined += [b" ".join([*(part.rstrip()[:-1] for part in parts[:-1]), line]), *[b""] * (len(parts) - 1)]
            parts = []
    return joined + parts


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
    return corners, sizes


def _is_index(word: bytes) -> bool:
    return re.fullmatch(rb"-?[0-9]{1,18}", word) is not None


def _absolute(corners: np.ndarray, vertices_before: np.ndarray) -> np.ndarray:
    """Indices from 0; negative ones count back from the vertices read so far; 0, which OBJ does not allow, becomes -1."""
    return np.where(corners >= 0, corners - 1, np.where(vertices_before + corners < 0, -1, vertices_before + corners))


def _check_complete(ends_inside_line: bool, lines: list[bytes], vertices: int, corners: np.ndarray, faces: int) -> None:
    stated = _stated_faces(lines)
    if stated is not None and faces < stated:
        raise ValueError(f"it is truncated: its header declares {stated} faces, {faces} are there")
    # Either sign alone occurs in intact files; a file truncated in the middle of its faces shows both.
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
