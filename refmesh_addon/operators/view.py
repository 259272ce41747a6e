"""Trails of centers."""

import bpy

from ..properties.selection import sequence_object
from .common import CentersOperator, SequenceOperator, object_mode, reporting


class REFMESH_OT_show_trails(CentersOperator, bpy.types.Operator):
    """Show the paths of the centers selected in edit mode as curves; of evenly many of all centers where none is selected"""

    bl_idname = "refmesh.show_trails"
    bl_label = "Show Trails"
    bl_options = {"UNDO"}

    @reporting
    def execute(self, context):
        from ..bridge.results.centers import center_radius
        from ..bridge.results.trails import show_trails

        owner = sequence_object(context)
        with object_mode(context):
            count = show_trails(owner, center_radius(owner))
        self.report({"INFO"}, f"{count} trails")
        return {"FINISHED"}


class REFMESH_OT_remove_trails(SequenceOperator, bpy.types.Operator):
    """Remove the trails of the centers"""

    bl_idname = "refmesh.remove_trails"
    bl_label = "Remove Trails"
    bl_options = {"UNDO"}

    @classmethod
    def poll_failure(cls, context):
        owner = sequence_object(context)
        return super().poll_failure(context) or ("" if owner.refmesh.trails else "there are no trails")

    @reporting
    def execute(self, context):
        from ..bridge.results.trails import remove_trails

        remove_trails(sequence_object(context))
        return {"FINISHED"}


CLASSES = (REFMESH_OT_show_trails, REFMESH_OT_remove_trails)
