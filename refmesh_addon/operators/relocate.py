"""Points a sequence at its frames again after they were moved."""

import bpy
from bpy.props import StringProperty

from ..core.counted import counted
from ..properties.selection import sequence_object
from .common import SequenceOperator, absolute, reporting


class REFMESH_OT_relocate_frames(SequenceOperator, bpy.types.Operator):
    """Point the sequence at its frames where they are now: pick any of the files"""

    bl_idname = "refmesh.relocate_frames"
    bl_label = "Find Frames"
    bl_options = {"UNDO"}

    filepath: StringProperty(name="File", description="Any frame of the sequence, or the folder of its frames", subtype="FILE_PATH")

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @reporting
    def execute(self, context):
        from ..bridge.results.relocation import relocate_frames

        owner = sequence_object(context)
        relocate_frames(owner, absolute(self.filepath))
        self.report({"INFO"}, owner.refmesh.missing or f"{counted(len(owner.refmesh.frames), 'frame')} found")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_relocate_frames,)
