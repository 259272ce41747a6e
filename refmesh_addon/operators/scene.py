"""Saves a scene that can be moved together with its results."""

import bpy
from bpy.props import StringProperty

from ..bridge.scene import timeline as scene
from .common import SceneOperator, absolute, reporting


class REFMESH_OT_save_scene(SceneOperator, bpy.types.Operator):
    """Save the scene with all paths relative to it, so that its folder can be moved"""

    bl_idname = "refmesh.save_scene"
    bl_label = "Save Scene"

    filepath: StringProperty(name="File", description="The .blend file to write", subtype="FILE_PATH")

    @reporting
    def execute(self, context):
        scene.save_scene(absolute(self.filepath))
        return {"FINISHED"}


CLASSES = (REFMESH_OT_save_scene,)
