"""Texture coordinates, materials and vertex colors of a Wavefront OBJ file."""

from __future__ import annotations

import os
from dataclasses import dataclass, field

import numpy as np

from ..core.color.appearance import Appearance
from ..core.types import TriangleMesh
from .images import decoded
from .mtl import Material, parse_mtl
from .obj import library_names, obj_lines, parse_obj
from .polygons import fan
from .texture_files import TextureFiles

WHITE = Material()


def obj_appearance(data: bytes, files: TextureFiles) -> Appearance | None:
    """What colors an OBJ: its images, else its vertex colors, else the plain colors of its materials; None for nothing of these.

    Raises ValueError, in words, for an OBJ that cannot be read, RefMeshError for an image that cannot be decoded.
    """
    lines = obj_lines(data)
    if _is_plain(lines, files):
        return None
    vertices, triangles, _ = parse_obj(data)
    faces = _Faces.of(lines)
    uvs, mapped, materials = faces.triangles()
    if len(uvs) != len(triangles):
        raise ValueError(f"{len(uvs)} of its {len(triangles)} triangles have corners that can be understood")
    library = _materials(lines, files)
    named = [library.get(name, WHITE) for name in faces.names]
    images, place = _images(named, np.unique(materials[mapped]), files)
    colored = _vertex_colors(lines, len(vertices))
    plain = np.rint(np.array([material.color for material in named]) * 255).astype(np.uint8)[materials]
    if not images and colored is None and (plain == 255).all():
        return None
    colors = plain[:, None].repeat(3, axis=1) if colored is None else colored[triangles]
    return Appearance(TriangleMesh(vertices, triangles), uvs, np.where(mapped, place[materials], -1), colors, images)


def _is_plain(lines: list[bytes], files: TextureFiles) -> bool:
    """Whether nothing colors the file, which its first vertex and the files beside it tell without parsing the rest."""
    first = next((line for line in lines if line.lstrip()[:2] in (b"v ", b"v\t")), b"")
    return len(_color_of(first)) < 3 and not library_names(lines) and files.by_number() is None


def obj_uvs(data: bytes) -> np.ndarray | None:
    """(T, 3, 2) float32 texture coordinates of the corners of the triangles; None unless all of them have some.

    Raises ValueError for numbers that cannot be understood.
    """
    uvs, mapped, _ = _Faces.of(obj_lines(data)).triangles()
    return uvs if len(uvs) and mapped.all() else None


@dataclass
class _Faces:
    """The faces of an OBJ in their order, as text.

    corners : of each face.  materials : of each face, index into `names`.  coordinates_before : texture coordinates read so far.
    """

    names: list[str] = field(default_factory=lambda: [""])
    _places: dict[str, int] = field(default_factory=lambda: {"": 0})
    corners: list[list[bytes]] = field(default_factory=list)
    materials: list[int] = field(default_factory=list)
    coordinates: list[list[bytes]] = field(default_factory=list)
    coordinates_before: list[int] = field(default_factory=list)

    @classmethod
    def of(cls, lines: list[bytes]) -> _Faces:
        result, current = cls(), 0
        for line in lines:
            word = line.lstrip()[:3]
            if word[:2] in (b"f ", b"f\t"):
                result._add(line.partition(b"#")[0].split()[1:], current)
            elif word in (b"vt ", b"vt\t"):
                result.coordinates.append(line.split()[1:3])
            elif word == b"use" and line.split()[:1] == [b"usemtl"]:
                current = result._named(line.split(None, 1)[1:])
        return result

    def _add(self, corners: list[bytes], material: int) -> None:
        if len(corners) > 2:
            self.corners.append(corners)
            self.materials.append(material)
            self.coordinates_before.append(len(self.coordinates))

    def _named(self, rest: list[bytes]) -> int:
        name = rest[0].decode("utf-8", "replace").strip() if rest else ""
        if name not in self._places:
            self._places[name] = len(self.names)
            self.names.append(name)
        return self._places[name]

    def triangles(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Texture coordinates (T, 3, 2) float32, whether (T,) all corners have some, and the material (T,) of each triangle."""
        sizes = np.array([len(corners) for corners in self.corners], dtype=np.int64)
        before = np.repeat(np.array(self.coordinates_before, dtype=np.int64), sizes)
        corners = fan(_uv_indices(self.corners, before, len(self.coordinates)), sizes)
        table = np.concatenate([_numbers(self.coordinates), np.zeros((1, 2), np.float32)])  # the last row: no coordinates
        return table[corners], (corners >= 0).all(axis=1), np.repeat(np.array(self.materials, dtype=np.int64), sizes - 2)


def _uv_indices(faces: list[list[bytes]], before: np.ndarray, count: int) -> np.ndarray:
    """Index from 0 of each corner's texture coordinates, -1 where it has none or they do not exist."""
    stated = [corner.split(b"/", 2)[1:2] for corners in faces for corner in corners]
    index = np.array([int(part[0]) if part and part[0] else 0 for part in stated], dtype=np.int64)
    index = np.where(index > 0, index - 1, np.where(index < 0, before + index, -1))
    return np.where((index >= 0) & (index < count), index, -1)


def _numbers(coordinates: list[list[bytes]]) -> np.ndarray:
    if not coordinates:
        return np.zeros((0, 2), np.float32)
    return np.array([[float(value) for value in (*pair, b"0")[:2]] for pair in coordinates], np.float32)


def _materials(lines: list[bytes], files: TextureFiles) -> dict[str, Material]:
    result: dict[str, Material] = {}
    for name in library_names(lines):
        library = files.read(name)
        if library is None and not files.notes:
            files.notes.append(f"{files.frame}: names the material library '{name}', which is not there")
        result |= parse_mtl(library or b"")
    return result


def _images(materials: list[Material], used: np.ndarray, files: TextureFiles) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Decoded images of the materials in use, each once, and for every material its place among them, -1 for none."""
    names = list(dict.fromkeys(materials[index].image for index in used))
    images: list[np.ndarray] = []
    places: dict[str, int] = {}
    known: dict[str, int] = {}  # by file, of which there can be many names
    for name in names:
        picture = files.picture(name, only=len(names) == 1)
        file = os.path.realpath(picture[0]) if picture else ""
        if picture and file not in known:
            known[file] = len(images)
            images.append(decoded(picture[1], str(picture[0])))
        places[name] = known.get(file, -1)
    return tuple(images), np.array([places.get(material.image, -1) for material in materials])


def _vertex_colors(lines: list[bytes], count: int) -> np.ndarray | None:
    """(V, 3) uint8 where every vertex has red, green and blue behind its place, 0 to 1 or, where one is larger, 0 to 255."""
    rows = [_color_of(line) for line in lines if line.lstrip()[:2] in (b"v ", b"v\t")]
    if len(rows) != count or any(len(row) != 3 for row in rows):
        return None
    values = np.array([[float(value) for value in row] for row in rows])
    scale = 255.0 if values.max(initial=0.0) <= 1.0 else 1.0
    return np.clip(np.rint(values * scale), 0, 255).astype(np.uint8)


def _color_of(vertex: bytes) -> list[bytes]:
    """The numbers behind the coordinates of a vertex line."""
    return vertex.partition(b"#")[0].split()[4:7]
