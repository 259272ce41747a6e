"""Animation that plays without the add-on: PC2 files through the Mesh Cache modifier, keyframed visibility."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...core.errors import RefMeshError
from ...io.pc2 import pc2_shape
from .objects import clear_animation

CACHE_NAME = "RefMesh Playback"
VISIBILITY = ("hide_viewport", "hide_render")


def check_cache(cache: Path, vertices: int) -> None:
    """Raises RefMeshError when a PC2 file is damaged or holds another number of points.

    Blender itself would show the rest shape and warn only on the console.
    """
    _, points = pc2_shape(cache)
    if points != vertices:
        raise RefMeshError(f"{cache}: holds {points} points, but its mesh has {vertices} vertices; run the step again")


def play_cache(target: bpy.types.Object, cache: Path, first_scene_frame: int) -> None:
    """Plays a PC2 file on the object; its first sample is shown at `first_scene_frame`; first and last sample are held."""
    modifier = target.modifiers.get(CACHE_NAME) or target.modifiers.new(CACHE_NAME, "MESH_CACHE")
    modifier.cache_format = "PC2"
    modifier.frame_start = first_scene_frame
    modifier.filepath = str(cache)


def cache_path(target: bpy.types.Object) -> Path:
    """The PC2 file that the object plays."""
    return Path(bpy.path.abspath(target.modifiers[CACHE_NAME].filepath))


def show_only_between(target: bpy.types.Object, first: int | None, end: int | None) -> None:
    """Keyframes the object's visibility: shown from scene frame `first` (None: always before) up to, not including, `end`."""
    clear_animation(target)
    for attribute in VISIBILITY:
        key_between(target, attribute, (first, end), inside=False, outside=True)


def key_between(
    target: bpy.types.Object | bpy.types.ShapeKey, attribute: str, span: tuple[int | None, int | None], inside: object, outside: object
) -> None:
    """Keyframes an attribute to `inside` from scene frame `span[0]` up to, not including, `span[1]`; None is unbounded.

    Keys are on consecutive frames, so that the interpolation mode does not matter.
    """
    first, end = span
    keys = [(first - 1, outside), (first, inside)] if first is not None else []
    keys += [(end - 1, inside), (end, outside)] if end is not None else []
    setattr(target, attribute, inside)
    for scene_frame, value in keys:
        setattr(target, attribute, value)
        target.keyframe_insert(attribute, frame=scene_frame)
