"""Operators: gather what is asked for, call, show. One operator serves button, script and render farm."""

import bpy

from . import (
    bodies,
    check,
    edit,
    export,
    help,
    installation,
    modal,
    object_sequence,
    picture,
    scene,
    sequence,
    settings,
    steps,
    timeline,
    view,
)

PARTS = (sequence, object_sequence, check, edit, bodies, modal, settings, steps, timeline, view, export, picture, scene, installation, help)
CLASSES = tuple(cls for part in PARTS for cls in part.CLASSES)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
