"""Operators: collect the arguments, call, show the result. One operator serves button, script and render farm."""

import bpy

from ..bridge.sequence.raw_sequence import read_files_with
from ..pipeline.process.reading import SHARED, read_colors, read_frame
from . import (
    bodies,
    cache,
    check,
    corrections,
    edit,
    export,
    farm_job,
    help,
    installation,
    modal,
    object_sequence,
    own_mesh,
    picture,
    relocate,
    scale,
    scene,
    scene_file,
    sequence,
    settings,
    steps,
    stream,
    timeline,
    view,
)

MODULES = (
    sequence,
    scene_file,
    object_sequence,
    check,
    edit,
    corrections,
    bodies,
    own_mesh,
    modal,
    settings,
    steps,
    timeline,
    view,
    export,
    farm_job,
    cache,
    stream,
    picture,
    relocate,
    scale,
    scene,
    installation,
    help,
)
CLASSES = tuple(cls for module in MODULES for cls in module.CLASSES)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    read_files_with(read_frame, read_colors)


def unregister():
    SHARED.close()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
