"""Handlers: a frame change shows the captured frame, a save makes paths relative, opening a file repairs those that are broken.

The handlers call no operator: Blender may be rendering or exporting when they run.
"""

from __future__ import annotations

import logging

import bpy
from bpy.app.handlers import persistent

from ..core.errors import RefMeshError
from .results.heat_map import show_errors
from .results.missing import missing_files
from .results.relocation import find_moved_files
from .results.visibility import is_seen
from .scene.paths import is_linked
from .scene.saving import fit_to_open_scene, make_relative
from .sequence.raw_sequence import forget_frames, show_frame

logger = logging.getLogger(__name__)
_reported: set[str] = set()


@persistent
def show_scene_frame(scene: bpy.types.Scene, depsgraph=None) -> None:
    """Frame-change handler: every sequence of the scene shows its frame; a file that fails is reported once."""
    for member in scene.objects:
        if member.refmesh.frames and not is_linked(member):
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
def repair_paths(*_) -> None:
    """File-load handler: finds frames and results that were moved with the scene, and notes what is missing."""
    for member in bpy.data.objects:
        if member.refmesh.frames and not is_linked(member):
            find_moved_files(member)
            member.refmesh.missing = missing_files(member)


@persistent
def before_save(target: str = "", *_) -> None:
    """Save handler: paths become relative to the file that is written."""
    make_relative(target)


@persistent
def after_save(*_) -> None:
    """Save handler: paths are relative to the file that is open, which a copy does not change."""
    fit_to_open_scene()


HANDLERS = (
    ("frame_change_post", show_scene_frame),
    ("load_post", repair_paths),
    ("save_pre", before_save),
    ("save_post", after_save),
    ("save_post_fail", after_save),
)


def register():
    """Adds all handlers."""
    for event, handler in HANDLERS:
        getattr(bpy.app.handlers, event).append(handler)


def unregister():
    """Removes them, frees the frames and forgets which errors were reported."""
    for event, handler in HANDLERS:
        getattr(bpy.app.handlers, event).remove(handler)
    forget_frames()
    _reported.clear()
