"""Universal Scene Description, by Blender's own importer and exporter."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...io.formats import Format
from .export import Export
from .files import check_disk_space, replacing
from .layers import groups_to_attributes, has_materials, supported
from .pictures import copy_pictures, is_textured, show_steady
from .velocities import moving_stand_ins

TEXTURES = "textures"  # folder beside the file, into which Blender puts the pictures of materials
EXTENSIONS = (".usd", ".usda", ".usdc", ".usdz")


def unavailable() -> str:
    """Why this Blender has no USD."""
    return "" if bpy.app.build_options.usd else "this Blender was built without USD"


def load(path: Path) -> None:
    """All objects of the file; the scene takes its frame range."""
    bpy.ops.wm.usd_import(filepath=str(path), set_frame_range=True)


def write(export: Export) -> list[Path]:
    """All groups in one file, each seen in its own frames only, with velocities, UV maps, materials, colors and vertex groups.

    Vertex groups are attributes of the points, "group_NAME" (primvars). Beside the file, pictures of materials are in
    "textures", those of the frames in a folder of their own.
    """
    target = export.target(EXTENSIONS[0])
    check_disk_space(export, target)
    textured = is_textured(export.owner)
    with moving_stand_ins(export) as copies, replacing(target) as partial:
        show_steady(export.owner, copies)
        with_materials = has_materials(copies.values())
        groups_to_attributes(copies.values(), prefix="group_")
        bpy.ops.wm.usd_export(
            filepath=str(partial),
            selected_objects_only=True,
            export_animation=True,
            export_normals=False,
            export_uvmaps=True,
            export_materials=with_materials,
            relative_paths=True,
            **(_copied_textures() if with_materials else {}),
            **supported(bpy.ops.wm.usd_export, export_mesh_colors=True, rename_uvmaps=False),
            convert_world_material=False,
            check_existing=False,
        )
    return [target, *(copy_pictures(export, target.parent / TEXTURES) if textured else [])]


def _copied_textures() -> dict[str, object]:
    """Options that put copies of the pictures into a folder "textures" beside the file."""
    known = bpy.ops.wm.usd_export.get_rna_type().properties
    return {"export_textures_mode": "NEW"} if "export_textures_mode" in known else {"export_textures": True}


FORMAT = Format(
    "usd",
    "USD",
    EXTENSIONS,
    load=load,
    write=write,
    contents="Universal Scene Description, all groups in one file, with velocities",
    every_frame=True,  # Blender's exporter has no step
    unavailable=unavailable,
)
