"""What the add-on shows of itself in Blender's preferences."""

import bpy

from ..pipeline.packages import missing_packages

ADDON = __package__.rpartition(".refmesh_addon")[0] or "refmesh_addon"  # the extension's own name, or that of the checkout's package


class REFMESH_AddonPreferences(bpy.types.AddonPreferences):
    """Says in words what of the installation is missing."""

    bl_idname = ADDON

    def draw(self, context):
        draw_missing(self.layout)
        self.layout.operator("refmesh.check_installation")


def draw_missing(layout):
    """What is missing, and below it what does not work without it; nothing when all packages are there."""
    for line in missing_packages():
        package, effect = line.split(": ")
        layout.label(text=package, icon="ERROR")
        layout.label(text=effect, icon="BLANK1")


def register():
    bpy.utils.register_class(REFMESH_AddonPreferences)


def unregister():
    bpy.utils.unregister_class(REFMESH_AddonPreferences)
