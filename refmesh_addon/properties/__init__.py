"""What the add-on keeps in the scene: the settings and the state of each sequence, on its mesh object."""

import bpy
from bpy.props import PointerProperty, StringProperty

from . import sequence, settings

CLASSES = (*settings.CLASSES, *sequence.CLASSES)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Object.refmesh = PointerProperty(type=sequence.RefMeshSequence, name="RefMesh")
    bpy.types.TimelineMarker.refmesh_sequence = PointerProperty(
        type=bpy.types.Object, name="Sequence", description="The mesh-sequence object whose group of frames begins here"
    )
    bpy.types.TimelineMarker.refmesh_name = StringProperty(
        name="Given Name", description="The name that RefMesh gave the marker; it differs from the present one once you rename it"
    )


def unregister():
    del bpy.types.TimelineMarker.refmesh_name
    del bpy.types.TimelineMarker.refmesh_sequence
    del bpy.types.Object.refmesh
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
