"""Animation that plays without the add-on: PC2 files through the Mesh Cache modifier, keyframed visibility."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...core.errors import RefMeshError
from ...io.pc2 import pc2_shape
from .animation import key_only_between
from .paths import absolute_path, stored_path

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
    """Plays a PC2 file on the object; its first sample is shown at `first_scene_frame`; first and last sample are held.

    A modifier that plays it already is left alone.
    """
    modifier = target.modifiers.get(CACHE_NAME)
    if modifier is None:
        modifier = target.modifiers.new(CACHE_NAME, "MESH_CACHE")
        modifier.cache_format = "PC2"
        target.modifiers.move(len(target.modifiers) - 1, 0)  # below what a person has put on the object
    if modifier.frame_start != first_scene_frame:
        modifier.frame_start = first_scene_frame
    if not modifier.filepath or cache_path(target) != cache:
        modifier.filepath = stored_path(cache)


def cache_path(target: bpy.types.Object) -> Path:
    """The PC2 file that the object plays."""
    return absolute_path(target, target.modifiers[CACHE_NAME].filepath)


def show_only_between(target: bpy.types.Object, first: int | None, end: int | None) -> None:
    """Keyframes the object's visibility: shown from scene frame `first` (None: always before) up to, not including, `end`."""
    for attribute in VISIBILITY:
        key_only_between(target, attribute, (first, end), inside=False, outside=True)
