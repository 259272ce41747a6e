"""Alembic, by Blender's own importer and exporter."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import bpy

from ...io.formats import Format
from .export import Export
from .files import check_disk_space, replacing
from .pictures import copy_pictures, is_textured
from .shown_parts import is_open, visibility_colors
from .velocities import moving_stand_ins

EXTENSION = ".abc"


def unavailable() -> str:
    """Why this Blender has no Alembic."""
    return "" if bpy.app.build_options.alembic else "this Blender was built without Alembic"


def load(path: Path) -> None:
    """All objects of the file; the scene takes its frame range."""
    bpy.ops.wm.alembic_import(filepath=str(path), set_frame_range=True, as_background_job=False)


def write(export: Export) -> list[Path]:
    """All groups in one file, each seen in its own frames only, with velocities and UV maps; pictures go beside the file.

    Of an open take, the color `visibility` says what each frame shows.
    """
    target = export.target(EXTENSION)
    check_disk_space(export, target)
    textured = is_textured(export.owner)
    is_colored = is_open(export)
    with (
        moving_stand_ins(export) as copies,
        visibility_colors(export, copies) if is_colored else nullcontext(),
        replacing(target) as partial,
    ):
        bpy.ops.wm.alembic_export(
            filepath=str(partial),
            selected=True,
            start=export.choice.first,
            end=export.choice.last,
            normals=False,
            uvs=True,
            vcolors=is_colored,
            as_background_job=False,
            check_existing=False,
        )
    return [target, *(copy_pictures(export) if textured else [])]


FORMAT = Format(
    "abc",
    "Alembic",
    (EXTENSION,),
    load=load,
    write=write,
    contents="Alembic, all groups in one file, with velocities",
    every_frame=True,  # Blender's exporter has no step
    unavailable=unavailable,
)
