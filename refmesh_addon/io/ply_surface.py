"""Geometry of a PLY file of any program: polygons of any size and triangle strips, in any type and byte order."""

from __future__ import annotations

import numpy as np

from .ply_elements import Ply, RaggedList, parse_ply
from .polygons import ParsedMesh, fan, strip_triangles

CORNER_LISTS = ("vertex_indices", "vertex_index")
_FACES, _STRIPS = ("face", "faces"), ("tristrips", "tristrip")


def parse_ply_surface(data: bytes) -> ParsedMesh:
    """Vertices in the order of the file and the triangles of its faces, then of its strips; other elements are ignored.

    Raises ValueError, saying what is wrong, for what is not a PLY, ends too early, or holds no positions.
    """
    ply = parse_ply(data)
    vertex = ply.elements.get("vertex", {})
    if not all(isinstance(vertex.get(axis), np.ndarray) for axis in "xyz"):
        raise ValueError("it holds no vertices with x, y and z")
    vertices = np.stack([np.asarray(vertex[axis], dtype=np.float64) for axis in "xyz"], axis=1)
    polygons, strips = _corner_lists(ply, _FACES), _corner_lists(ply, _STRIPS)
    parts = [fan(_signed(one), one.sizes) for one in polygons] + [strip_triangles(_signed(one), one.sizes) for one in strips]
    omitted = sum(int(np.count_nonzero(one.sizes < 3)) for one in polygons)
    return ParsedMesh(vertices, np.concatenate([np.empty((0, 3), np.int64), *parts]), omitted)


def _corner_lists(ply: Ply, elements: tuple[str, ...]) -> list[RaggedList]:
    tables = [ply.elements[name] for name in elements if name in ply.elements]
    lists = [next((table[name] for name in CORNER_LISTS if name in table), None) for table in tables]
    return [one for one in lists if isinstance(one, RaggedList)]


def _signed(corners: RaggedList) -> np.ndarray:
    return corners.values.astype(np.int64)
