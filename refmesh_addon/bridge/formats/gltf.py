"""glTF, by the add-on that Blender brings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import bpy

from ...core.options import option
from ...io.files import atomic_file
from ...io.formats import GLB
from ..scene.timeline import timeline
from .export import Export
from .files import replacing
from .layers import groups_to_attributes, has_materials, supported
from .pictures import show_steady
from .small_gltf import small_choice, small_file
from .stand_ins import morphing_stand_ins


@dataclass(frozen=True)
class GlbOptions:
    """Options of the format."""

    size: str = option(
        "full",
        "How the frames are stored",
        choices={
            "full": "Every vertex of every frame, as Blender exports it",
            "small": "Fewer triangles and a few morph targets in whole numbers, for the web: some 50 times smaller",
        },
    )
    error: float = option(0.05, "Small files: RMS distance from the frames, % of the diagonal", low=0.002, high=5.0)
    mbps: float = option(
        0.0, "Small files: megabits per second, from which the error follows, by the first group; 0 takes the error", low=0.0, high=1000.0
    )
    packed: bool = option(False, "Small files: packed to a third by EXT_meshopt_compression; Blender reads it from 5.2 on")
    normals: bool = option(True, "Small files: with normals where there are no colors, so that viewers shade smoothly")
    texture: int = option(1024, "Small files: greatest side of a texture, pixels; 0 leaves colors out", low=0, high=8192)
    image: str = option(
        "webp",
        "Small files: how textures are stored",
        choices={
            "webp": "WebP, the smallest, for web browsers and Blender",
            "png": "PNG, without loss, for every program",
            "jpg": "JPEG, for every program",
        },
        titles={"webp": "WebP", "png": "PNG", "jpg": "JPEG"},
    )


def unavailable() -> str:
    """Why this Blender writes no glTF."""
    return "" if hasattr(bpy.types, "EXPORT_SCENE_OT_gltf") else "the add-on 'glTF 2.0 format' is not enabled"


def write(export: Export) -> list[Path]:
    """As small as the options say."""
    return _write_small(export) if export.options.size == "small" else _write_full(export)


def _write_small(export: Export) -> list[Path]:
    options: GlbOptions = export.options
    choice = small_choice(
        export,
        error=options.error / 100,
        packed=options.packed,
        normals=options.normals,
        texture=options.texture,
        image=f".{options.image}",
    )
    data, target = small_file(export, choice, options.mbps)[0], export.target(GLB.extensions[0])
    with atomic_file(target) as file:
        file.write(data)
    return [target]


def _write_full(export: Export) -> list[Path]:
    """All groups in one file, with a morph target for each frame and one animation that plays them.

    UV maps, materials with their images, colors and vertex groups go along, the last as attributes "_NAME".
    """
    choice, target = export.choice, export.target(GLB.extensions[0])
    span = timeline(bpy.context.scene, choice.first, choice.last)
    with morphing_stand_ins(export) as copies, span, replacing(target) as partial:
        show_steady(export.owner, copies)
        has_groups = groups_to_attributes(copies.values(), prefix="_")  # glTF's mark of attributes of one's own
        bpy.ops.export_scene.gltf(
            filepath=str(partial),
            export_format="GLB",
            use_selection=True,
            export_animation_mode="SCENE",  # one animation that plays all groups, not one for each
            export_anim_scene_split_object=False,
            export_frame_range=True,
            export_frame_step=choice.step,
            export_materials="EXPORT" if has_materials(copies.values()) else "NONE",
            export_attributes=has_groups,
            **supported(bpy.ops.export_scene.gltf, export_vertex_color="ACTIVE", export_all_vertex_colors=True),
            check_existing=False,
        )
    return [target]


FORMAT = replace(GLB, write=write, contents="glTF binary with morph targets", options=GlbOptions, unavailable=unavailable)
