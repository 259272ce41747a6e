"""Operators: gather what is asked for, call, show. One operator serves button, script and render farm."""

import bpy

from . import export, installation, picture, scene, sequence, settings, steps

CLASSES = (*sequence.CLASSES, *settings.CLASSES, *steps.CLASSES, *export.CLASSES, *picture.CLASSES, *scene.CLASSES, *installation.CLASSES)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
