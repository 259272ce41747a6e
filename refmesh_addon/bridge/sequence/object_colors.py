"""The colors of an object of the scene, as a render would see them: its UV map with the images of its materials, or its color attribute."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...core.types import TriangleMesh
from ...io.images import EXTENSIONS
from ...io.ply import write_ply
from ...io.textured_ply import write_textured_ply
from ..scene.paths import state_digest


@dataclass(frozen=True)
class Picture:
    """An image file.  packed : its bytes where they are in the scene, as those of a USDZ file are; None where they are at `path`."""

    path: Path
    packed: bytes | None

    @property
    def name(self) -> str:
        """For a copy: without digits, which would be taken for the number of a frame."""
        digest = state_digest(self.path) if self.packed is None else hashlib.blake2b(self.packed, digest_size=8).hexdigest()
        return "picture_" + digest.translate(str.maketrans("0123456789", "ghijklmnop")) + self.path.suffix.lower()

    def copy(self, path: Path) -> None:
        """Writes the file once more."""
        if self.packed is None:
            shutil.copyfile(self.path, path)
        else:
            path.write_bytes(self.packed)


@dataclass(frozen=True)
class ObjectColors:
    """uvs : (T, 3, 2) float32 of the corners of the triangles.  materials : (T,) int32, index into `pictures`, -1 for none.
    pictures : of the materials.  colors : (V, 4) uint8 of the vertices; None without a color attribute.
    """

    uvs: np.ndarray
    materials: np.ndarray
    pictures: tuple[Picture, ...]
    colors: np.ndarray | None


def evaluated_colors(target: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> ObjectColors:
    """Colors of the triangles that `evaluated_mesh` gives, in their order."""
    evaluated = target.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        mesh.calc_loop_triangles()
        loops, places = np.empty(3 * len(mesh.loop_triangles), np.int32), np.empty(len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("loops", loops)
        mesh.loop_triangles.foreach_get("material_index", places)
        files = [_picture(slot.material) for slot in evaluated.material_slots]
        mapped = len(mesh.uv_layers) > 0
        uvs = _uvs(mesh)[loops].reshape(-1, 3, 2)
        colors = _vertex_colors(mesh)
    finally:
        evaluated.to_mesh_clear()
    mirrored = np.linalg.det(np.array(evaluated.matrix_world, dtype=float)[:3, :3]) < 0
    pictures = tuple(dict.fromkeys(file for file in files if file is not None))
    lookup = np.array([pictures.index(file) if file is not None else -1 for file in files] or [-1], np.int32)
    materials = lookup[np.clip(places, 0, len(lookup) - 1)]
    return ObjectColors(uvs[:, ::-1] if mirrored else uvs, materials, pictures if mapped else (), colors)


def write_object_frame(path: Path, mesh: TriangleMesh, colors: ObjectColors) -> None:
    """A frame with its colors; pictures go beside it once each, however many frames show them."""
    if not colors.pictures:
        write_ply(path, mesh, colors.colors)
        return
    names = [picture.name for picture in colors.pictures]
    for picture, name in zip(colors.pictures, names):
        if not (path.parent / name).exists():
            picture.copy(path.parent / name)
    write_textured_ply(path, mesh, colors.uvs, colors.materials, names)


def _uvs(mesh: bpy.types.Mesh) -> np.ndarray:
    """(L, 2) of all corners, in the UV map that renders use; zeros without one."""
    result = np.zeros(2 * len(mesh.loops), np.float32)
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    if layer is not None:
        layer.uv.foreach_get("vector", result)
    return result.reshape(-1, 2)


def _picture(material: bpy.types.Material | None) -> Picture | None:
    """The image that a material shows in the present frame; None where there is none that can be read."""
    if material is None or material.node_tree is None:
        return None
    nodes = [node for node in material.node_tree.nodes if node.type == "TEX_IMAGE" and node.image is not None]
    colored = [node for node in nodes if any(link.to_socket.name in ("Base Color", "Color") for link in node.outputs["Color"].links)]
    if not nodes:
        return None
    node = (colored or nodes)[0]
    path = Path(bpy.path.abspath(node.image.filepath_from_user(image_user=node.image_user)))
    packed = node.image.packed_file.data if node.image.packed_file else None
    return Picture(path, packed) if path.suffix.lower() in EXTENSIONS and (packed or path.is_file()) else None


def _vertex_colors(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """(V, 4) uint8 sRGB of the color attribute that renders use, the mean over the corners at each vertex."""
    index = mesh.color_attributes.render_color_index
    if not 0 <= index < len(mesh.color_attributes):
        return None
    attribute = mesh.color_attributes[index]
    values = np.empty(4 * len(attribute.data), np.float32)
    attribute.data.foreach_get("color_srgb", values)
    values = values.reshape(-1, 4)
    if attribute.domain == "CORNER":
        corners = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", corners)
        count = np.maximum(np.bincount(corners, minlength=len(mesh.vertices)), 1)
        sums = [np.bincount(corners, values[:, channel], len(mesh.vertices)) for channel in range(4)]
        values = np.stack(sums, axis=1) / count[:, None]
    return np.clip(np.rint(values * 255), 0, 255).astype(np.uint8) if len(values) == len(mesh.vertices) else None
