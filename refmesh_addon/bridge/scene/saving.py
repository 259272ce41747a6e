"""Paths of a scene are relative to it from its first save on, by File > Save too."""

from __future__ import annotations

import os

import bpy

from .paths import library_of, stored_path
from .playback import CACHE_NAME
from .timeline import TEXTURE_MARK

_absolute: list[tuple[bpy.types.bpy_struct, str, str]] = []  # holder, name of the property, absolute path, during a save


def make_relative(target: str) -> None:
    """Before a save to `target`: paths become relative to its folder."""
    _absolute.clear()
    folder = os.path.dirname(target or bpy.data.filepath)
    if not folder:  # the startup file
        return
    _absolute.extend(_sequence_paths())
    for holder, name, path in _absolute:
        setattr(holder, name, stored_path(path, folder))
    if bpy.data.filepath:
        # Blender carries relative paths of modifiers and images from the folder of the present file to the new one. Before the first
        # save it makes all of them relative.
        for holder in (*_caches(), *_textures()):
            if not holder.filepath.startswith("//"):
                holder.filepath = stored_path(holder.filepath)


def fit_to_open_scene(*_) -> None:
    """After a save, also one that failed or wrote a copy: paths are relative to the scene that is open."""
    for holder, name, path in _absolute:
        setattr(holder, name, stored_path(path))
    _absolute.clear()


def _sequence_paths() -> list[tuple[bpy.types.bpy_struct, str, str]]:
    """Each path that a sequence of this file remembers, in its absolute form."""
    states = [candidate.refmesh for candidate in bpy.data.objects if candidate.refmesh.frames and library_of(candidate) is None]
    holders = [(state, name) for state in states for name in ("source", "output")]
    holders += [(frame, "path") for state in states for frame in state.frames]
    holders += [(group, "cache") for state in states for group in state.groups]
    paths = [(holder, name, getattr(holder, name)) for holder, name in holders]
    return [(holder, name, os.path.normpath(bpy.path.abspath(path))) for holder, name, path in paths if path]


def _caches() -> list[bpy.types.MeshCacheModifier]:
    """The modifiers of this file that play results."""
    own = [candidate for candidate in bpy.data.objects if candidate.library is None and CACHE_NAME in candidate.modifiers]
    return [candidate.modifiers[CACHE_NAME] for candidate in own]


def _textures() -> list[bpy.types.Image]:
    """The images of this file that are textures of results."""
    return [image for image in bpy.data.images if image.library is None and TEXTURE_MARK in image]
