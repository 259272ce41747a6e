"""Embedded images, texture coordinates and vertex colors of a GLB file, read by trimesh."""

from __future__ import annotations

import numpy as np

from ..core.color.appearance import Appearance
from ..core.types import TriangleMesh
from .glb_limits import check_glb
from .images import check_pixels, eight_bits
from .texture_files import TextureFiles
from .trimesh_reader import load_scene, outward_faces, placed_meshes


def glb_appearance(data: bytes, files: TextureFiles) -> Appearance | None:
    """What colors a GLB; None for nothing. trimesh turns glTF's v, which counts from the top, the right way up."""
    check_glb(data)
    images = _Images(len(data), str(files.frame))
    parts = [_part(part, transform, images) for part, transform in placed_meshes(load_scene(data, "glb"))]
    if not parts or not images.arrays and all((colors == 255).all() for _, _, _, _, colors in parts):
        return None
    starts = np.cumsum([0] + [len(part[0]) for part in parts])
    vertices, triangles, uvs, materials, colors = zip(*parts)
    mesh = TriangleMesh(np.concatenate(vertices), np.concatenate([part + start for part, start in zip(triangles, starts)]))
    return Appearance(mesh, np.concatenate(uvs), np.concatenate(materials), np.concatenate(colors), tuple(images.arrays))


class _Images:
    """Images by identity, each brought to an array once.  size : bytes of the file called `name`, which holds them all."""

    def __init__(self, size: int, name: str):
        self.arrays: list[np.ndarray] = []
        self._size, self._name, self._pixels = size, name, 0
        self._known: dict[int, int] = {}

    def place(self, image) -> int:
        if image is None:
            return -1
        if id(image) not in self._known:
            self._pixels += image.width * image.height
            check_pixels(self._pixels, self._size, self._name)
            self._known[id(image)] = len(self.arrays)
            self.arrays.append(eight_bits(image))
        return self._known[id(image)]


def _part(part, transform: np.ndarray, images: _Images) -> tuple[np.ndarray, ...]:
    """Vertices, triangles, uvs, materials and colors of one object in its place."""
    faces = outward_faces(part, transform)
    vertices = part.vertices @ transform[:3, :3].T + transform[:3, 3]
    visual = part.visual
    material, uv = getattr(visual, "material", None), getattr(visual, "uv", None)
    image = None if uv is None else getattr(material, "baseColorTexture", None)
    uvs = np.zeros((len(faces), 3, 2), np.float32) if uv is None else np.asarray(uv, np.float32)[faces]
    return vertices, faces, uvs, np.full(len(faces), images.place(image)), _colors(visual, material, faces)


def _colors(visual, material, faces: np.ndarray) -> np.ndarray:
    """(T, 3, 3) uint8: vertex colors, else the material's base color, else white."""
    if visual.kind == "vertex":
        return np.asarray(visual.vertex_colors, np.uint8)[:, :3][faces]
    factor = getattr(material, "baseColorFactor", None)
    color = np.full(3, 255, np.uint8) if factor is None else np.asarray(factor, np.uint8)[:3]
    return np.broadcast_to(color, (len(faces), 3, 3)).copy()
