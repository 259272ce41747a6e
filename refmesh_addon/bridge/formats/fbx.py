"""FBX, by the add-on that Blender brings."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...io.formats import Format
from ..scene.timeline import timeline
from .export import Export
from .files import replacing
from .layers import has_materials
from .pictures import show_steady
from .stand_ins import morphing_stand_ins


def unavailable() -> str:
    """Why this Blender writes no FBX."""
    return "" if hasattr(bpy.types, "EXPORT_SCENE_OT_fbx") else "the add-on 'FBX format' is not enabled"


def write(export: Export) -> list[Path]:
    """All groups in one file, with a shape key for each chosen frame, which turn into each other: with a step, key frames alone."""
    choice, target = export.choice, export.target(FORMAT.extensions[0])
    span = timeline(bpy.context.scene, choice.first, choice.last)
    with morphing_stand_ins(export, blended=True) as copies, span, replacing(target) as partial:
        show_steady(export.owner, copies)
        bpy.ops.export_scene.fbx(
            filepath=str(partial),
            use_selection=True,
            object_types={"EMPTY", "MESH"},
            use_mesh_modifiers=False,  # which would leave out shape keys
            bake_anim=True,
            bake_anim_use_all_bones=False,
            bake_anim_use_nla_strips=False,
            bake_anim_use_all_actions=False,
            bake_anim_simplify_factor=0.0,
            path_mode="COPY" if has_materials(copies.values()) else "AUTO",
            embed_textures=has_materials(copies.values()),
            check_existing=False,
        )
    return [target]


FORMAT = Format(
    "fbx",
    "FBX",
    (".fbx",),
    write=write,
    contents="For game engines and other programs, a shape key for each frame; with a step, for key frames that turn into each other",
    unavailable=unavailable,
)
