"""The colors of the captured frames on the sequence object: each frame with its own pictures, of which Blender holds one frame's."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ...io.source_colors import SourceColors
from ..scene.materials import SOURCE_COLOR, attribute_material, image_material, plain_material
from ..scene.meshes import COLOR_NAME
from ..scene.paths import state_digest, stored_path

UV_NAME = "Capture"
MARK = "refmesh_source_color"  # custom property of materials and images that are made here
SOURCE_MATERIAL = "RefMesh Source"


def pictures_folder() -> Path:
    """For pictures that are inside of a frame's file; Blender removes it when it quits."""
    folder = Path(bpy.app.tempdir) / "refmesh_pictures"
    folder.mkdir(exist_ok=True)
    return folder


def plain_source() -> bpy.types.Material:
    """The material of captured frames without color."""
    return plain_material(SOURCE_MATERIAL, SOURCE_COLOR)


def show_colors(owner: bpy.types.Object, colors: SourceColors | None) -> None:
    """Colors the frame that the mesh of `owner` holds; None shows it plain. Materials of the user's own stay."""
    mesh = owner.data
    if not all(material is None or material.get(MARK) or material == plain_source() for material in mesh.materials):
        return
    if colors is None or len(colors.materials) != len(mesh.polygons) or not len(mesh.polygons):
        _set_materials(mesh, [plain_source()])
        return
    name = f"{owner.name} color"
    materials = [_picture_material(f"{name} {index}", Path(picture)) for index, picture in enumerate(colors.pictures)]
    uncolored = colors.materials < 0
    if uncolored.any():
        materials.append(_marked(attribute_material(f"{name} attribute", COLOR_NAME)))
        _set_corner_colors(mesh, colors.colors)
    if colors.pictures:
        layer = mesh.uv_layers.get(UV_NAME) or mesh.uv_layers.new(name=UV_NAME)
        layer.uv.foreach_set("vector", np.ascontiguousarray(colors.uvs, np.float32).ravel())
    _set_materials(mesh, materials)
    mesh.polygons.foreach_set("material_index", np.where(uncolored, len(materials) - 1, colors.materials).astype(np.int32))
    mesh.update()


def _set_materials(mesh: bpy.types.Mesh, materials: list[bpy.types.Material]) -> None:
    if list(mesh.materials) != materials:
        mesh.materials.clear()
        for material in materials:
            mesh.materials.append(material)


def _picture_material(name: str, picture: Path) -> bpy.types.Material:
    """A material that shows this picture in place of the one before, which leaves memory with it."""
    image = _picture(picture)
    material = bpy.data.materials.get(name)
    node = None if material is None else next((item for item in material.node_tree.nodes if item.type == "TEX_IMAGE"), None)
    before = None if node is None else node.image
    if before == image:
        return material
    material = _marked(image_material(name, image))
    if before is not None and before.get(MARK) and before.users == 0:
        bpy.data.images.remove(before)
    return material


def _picture(path: Path) -> bpy.types.Image:
    """The picture of a file in its present state."""
    state = state_digest(path)
    known = next((image for image in bpy.data.images if image.get(MARK) == state), None)
    if known is None:
        known = bpy.data.images.load(str(path))
        known[MARK] = state
    known.filepath = stored_path(path)
    return known


def _marked(material: bpy.types.Material) -> bpy.types.Material:
    material[MARK] = True
    return material


def _set_corner_colors(mesh: bpy.types.Mesh, colors: np.ndarray) -> None:
    """(T, 3, 3) uint8 sRGB as colors of the corners."""
    attribute = mesh.color_attributes.get(COLOR_NAME) or mesh.color_attributes.new(COLOR_NAME, "BYTE_COLOR", "CORNER")
    values = np.ones((colors.shape[0] * 3, 4), np.float32)
    values[:, :3] = colors.reshape(-1, 3) / np.float32(255)
    attribute.data.foreach_set("color_srgb", values.ravel())
