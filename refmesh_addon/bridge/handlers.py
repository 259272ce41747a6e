"""Handlers: a frame change shows the captured frame, opening a file looks for missing files.

The handlers call no operator: Blender may be rendering or exporting when they run.
"""

from __future__ import annotations

import logging

import bpy
from bpy.app.handlers import persistent

from ..core.errors import RefMeshError
from .results.heat_map import show_errors
from .results.missing import missing_files
from .results.visibility import is_seen
from .sequence.raw_sequence import forget_frames, show_frame

logger = logging.getLogger(__name__)
_reported: set[str] = set()


@persistent
def show_scene_frame(scene: bpy.types.Scene, depsgraph=None) -> None:
    """Frame-change handler: every sequence of the scene shows its frame; a file that fails is reported once."""
    for member in scene.objects:
        if member.refmesh.frames and member.library is None:
            try:
                if is_seen(member):
                    show_frame(member, scene.frame_current)
                if member.refmesh.heat_map:
                    show_errors(member, scene.frame_current)
            except RefMeshError as error:
                if str(error) not in _reported:
                    _reported.add(str(error))
                    logger.warning("%s", error)


@persistent
def note_missing_files(*_) -> None:
    """File-load handler: notes which files each sequence misses."""
    for member in bpy.data.objects:
        if member.refmesh.frames and member.library is None:
            member.refmesh.missing = missing_files(member)


def register():
    """Adds both handlers."""
    bpy.app.handlers.frame_change_post.append(show_scene_frame)
    bpy.app.handlers.load_post.append(note_missing_files)


def unregister():
    """Removes them, frees the frames and forgets which errors were reported."""
    bpy.app.handlers.frame_change_post.remove(show_scene_frame)
    bpy.app.handlers.load_post.remove(note_missing_files)
    forget_frames()
    _reported.clear()
