"""Renders a picture of source, reference mesh and result."""

import bpy
from bpy.props import IntProperty, StringProperty

from ..properties.selection import sequence_object
from .common import SequenceOperator, absolute, reporting, wait_cursor


class REFMESH_OT_render_preview(SequenceOperator, bpy.types.Operator):
    """Render source, reference mesh and deformed mesh of the current frame side by side"""

    bl_idname = "refmesh.render_preview"
    bl_label = "Render Preview"

    filepath: StringProperty(
        name="Picture", description="PNG file to write; empty takes preview.png in the output folder", subtype="FILE_PATH"
    )

    width: IntProperty(name="Width", description="Width of the picture in pixels", default=1600, min=64, max=16384)

    @reporting
    def execute(self, context):
        from ..bridge.picture.preview import render_preview

        owner = sequence_object(context)
        results = absolute(owner.refmesh.output)
        target = absolute(self.filepath) if self.filepath else results / "preview.png"
        with wait_cursor(context):
            render_preview(owner, context.scene.frame_current, results, target, self.width)
        self.report({"INFO"}, f"wrote {target}")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_render_preview,)
