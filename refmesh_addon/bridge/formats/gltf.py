"""glTF, by the add-on that Blender brings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ...core.options import option
from ...io.files import atomic_file
from ...io.formats import GLB
from ..scene.timeline import timeline
from .export import Export
from .files import replacing
from .layers import groups_to_attributes, has_materials, supported
from .pictures import show_steady
from .shown_parts import add_mean_visibility
from .small_gltf import SmallOptions, small_choice, small_estimate, small_file, small_note
from .stand_ins import morphing_stand_ins

if TYPE_CHECKING:
    from ...io.small_glb.choice import SmallGlb


@dataclass(frozen=True)
class GlbOptions(SmallOptions):
    """Options of the format."""

    size: str = option(
        "full",
        "How the frames are stored",
        choices={
            "full": "Every vertex of every frame, as Blender exports it",
            "small": "Fewer triangles and a few morph targets in whole numbers, for the web: some 50 times smaller",
        },
    )
    mbps: float = option(
        0.0, "Small files: megabits per second, from which the error follows, by the first group; 0 takes the error", low=0.0, high=1000.0
    )
    packed: bool = option(False, "Small files: packed to a third by EXT_meshopt_compression; only Blender 5.2 or later can read it")
    normals: bool = option(True, "Small files: with normals where there are no colors, so that viewers shade smoothly")
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


def estimate(export: Export) -> str:
    """Of a small file; what a full one takes is told by its frames and vertices alone."""
    return small_estimate(export, _choice(export))


def _choice(export: Export) -> SmallGlb:
    options: GlbOptions = export.options
    return small_choice(export, options, packed=options.packed, normals=options.normals, image=f".{options.image}")


def _write_small(export: Export) -> list[Path]:
    data, runs = small_file(export, _choice(export), export.options.mbps)
    target = export.target(GLB.extensions[0])
    with atomic_file(target) as file:
        file.write(data)
    export.notes.append(small_note(data, runs))
    return [target]


def _write_full(export: Export) -> list[Path]:
    """All groups in one file, with a morph target for each frame and one animation that plays them.

    UV maps, materials with their images, colors and vertex groups go along, the last as attributes "_NAME"; of an open take also
    "_VISIBILITY", the share of the frames that show a vertex.
    """
    choice, target = export.choice, export.target(GLB.extensions[0])
    span = timeline(bpy.context.scene, choice.first, choice.last)
    with morphing_stand_ins(export) as copies, span, replacing(target) as partial:
        show_steady(export.owner, copies)
        has_shown = add_mean_visibility(export, copies)
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
            export_attributes=has_groups or has_shown,
            **supported(bpy.ops.export_scene.gltf, export_vertex_color="ACTIVE", export_all_vertex_colors=True),
            check_existing=False,
        )
    return [target]


FORMAT = replace(
    GLB, write=write, contents="glTF binary with morph targets", estimate=estimate, options=GlbOptions, unavailable=unavailable
)
