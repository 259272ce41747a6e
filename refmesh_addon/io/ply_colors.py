"""Colors and texture coordinates of a PLY file: of vertices, of faces, or in the picture that a TextureFile comment names."""

from __future__ import annotations

import numpy as np

from ..core.color.appearance import Appearance
from ..core.geometry.ragged import ragged_indices
from ..core.types import TriangleMesh
from .images import decoded
from .ply_elements import Ply, RaggedList, parse_ply
from .ply_surface import CORNER_LISTS
from .polygons import fan
from .texture_files import TextureFiles

_CHANNELS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))
_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))


def ply_appearance(data: bytes, files: TextureFiles) -> Appearance | None:
    """What colors a PLY; None for nothing, or for a file without faces that could be read here.

    Raises ValueError, in words, for a PLY that cannot be read, RefMeshError for a picture that cannot be decoded.
    """
    ply = parse_ply(data)
    vertex, face = ply.elements.get("vertex", {}), ply.elements.get("face", {})
    polygons = next((face[name] for name in CORNER_LISTS if name in face), None)
    if not isinstance(polygons, RaggedList) or not {"x", "y", "z"} <= vertex.keys():
        return None
    whole = polygons.sizes > 2
    corner, place = ragged_indices(polygons.sizes)
    kept = whole[corner]
    triangles = fan(polygons.values.astype(np.int64)[kept], polygons.sizes[whole])
    owner = np.repeat(np.flatnonzero(whole), polygons.sizes[whole] - 2)  # the face of each triangle
    corners = fan(np.flatnonzero(kept), polygons.sizes[whole])  # which of all corners each is
    mesh = TriangleMesh(np.stack([np.asarray(vertex[axis], dtype=np.float64) for axis in "xyz"], axis=1), triangles)
    uvs = _corner_uvs(vertex, face, triangles, (corner, place), corners)
    images, material = _images(ply, face, owner, files) if uvs is not None else ((), np.full(len(triangles), -1))
    colors = _colors(ply, "vertex", triangles)
    if colors is None:
        of_faces = _colors(ply, "face", owner)
        colors = None if of_faces is None else of_faces[:, None].repeat(3, axis=1)
    if not images and colors is None:
        return None
    flat = np.full((len(triangles), 3, 3), 255, np.uint8) if colors is None else colors
    return Appearance(mesh, np.zeros((len(triangles), 3, 2), np.float32) if uvs is None else uvs, material, flat, images)


def _corner_uvs(vertex: dict, face: dict, triangles: np.ndarray, numbering: tuple, corners: np.ndarray) -> np.ndarray | None:
    """(T, 3, 2) float32 from a list of six or more numbers for each face, or from two of each vertex."""
    stated = face.get("texcoord")
    if isinstance(stated, RaggedList) and len(stated.values):
        owner, place = numbering
        starts = np.cumsum(stated.sizes) - stated.sizes
        at = starts[owner] + 2 * place
        known = 2 * place + 1 < stated.sizes[owner]
        pairs = np.stack([stated.values[np.where(known, at + step, 0)] for step in (0, 1)], axis=1).astype(np.float32)
        return np.where(known[:, None], pairs, np.float32(0.0))[corners]
    for names in _UV_NAMES:
        if set(names) <= vertex.keys():
            return np.stack([np.asarray(vertex[name], dtype=np.float32) for name in names], axis=1)[triangles]
    return None


def _images(ply: Ply, face: dict, owner: np.ndarray, files: TextureFiles) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Pictures of the TextureFile comments, in their order, and the (T,) picture of each triangle, by `texnumber` where it is stated."""
    stated = [comment.partition(" ") for comment in ply.comments]
    names = [name.strip().replace("\\", "/") for key, _, name in stated if key.lower() == "texturefile"] or [""]
    pictures = [files.picture(name, only=len(names) == 1) for name in names]
    numbers = np.asarray(face["texnumber"], dtype=np.int64)[owner] if "texnumber" in face else np.zeros(len(owner), np.int64)
    place = np.cumsum([picture is not None for picture in pictures]) - 1
    lookup = np.where([picture is not None for picture in pictures], place, -1)
    inside = (numbers >= 0) & (numbers < len(names))
    images = tuple(decoded(picture[1], str(picture[0])) for picture in pictures if picture is not None)
    return images, np.where(inside, lookup[np.where(inside, numbers, 0)], -1)


def _colors(ply: Ply, element: str, index: np.ndarray) -> np.ndarray | None:
    """Colors of vertices or faces as uint8, those of `index`; 16-bit and floating-point ones are brought to 8 bits."""
    table = ply.elements.get(element, {})
    for names in _CHANNELS:
        if set(names) <= table.keys():
            values = np.stack([np.asarray(table[name], dtype=np.float64) for name in names], axis=1)
            kind = ply.types[f"{element} {names[0]}"]
            scale = {"u1": 1.0, "u2": 255 / 65535}.get(kind, 255.0 if kind.startswith("f") and values.max(initial=0) <= 1 else 1.0)
            return np.clip(np.rint(values * scale), 0, 255).astype(np.uint8)[index]
    return None
