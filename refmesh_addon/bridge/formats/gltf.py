"""glTF, by the add-on that Blender brings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import bpy

from ...io.formats import GLB
from ..scene.timeline import timeline
from .export import Export
from .files import replacing
from .stand_ins import morphing_stand_ins


def unavailable() -> str:
    """Why this Blender writes no glTF."""
    return "" if hasattr(bpy.types, "EXPORT_SCENE_OT_gltf") else "the add-on 'glTF 2.0 format' is not enabled"


def write(export: Export) -> list[Path]:
    """All groups in one file, with a morph target for each frame and one animation that plays them."""
    choice, target = export.choice, export.target(GLB.extensions[0])
    span = timeline(bpy.context.scene, choice.first, choice.last)
    with morphing_stand_ins(export.owner, choice), span, replacing(target) as partial:
        bpy.ops.export_scene.gltf(
            filepath=str(partial),
            export_format="GLB",
            use_selection=True,
            export_animation_mode="SCENE",  # one animation that plays all groups, not one for each
            export_anim_scene_split_object=False,
            export_frame_range=True,
            export_frame_step=choice.step,
            export_materials="NONE",
            check_existing=False,
        )
    return [target]


FORMAT = replace(GLB, write=write, contents="glTF binary with one morph target for each frame", unavailable=unavailable)
