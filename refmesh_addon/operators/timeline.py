"""Sets the timeline of the scene to a sequence, and goes to single frames of it."""

import bpy
from bpy.props import FloatProperty, StringProperty

from ..core.errors import RefMeshError
from ..properties.selection import sequence_object
from .common import NO_SEQUENCE, SequenceOperator, reporting


class REFMESH_OT_set_timeline(SequenceOperator, bpy.types.Operator):
    """Set the frame range of the scene to that of the sequence"""

    bl_idname = "refmesh.set_timeline"
    bl_label = "Set Timeline"
    bl_options = {"REGISTER", "UNDO"}

    fps: FloatProperty(
        name="Frame Rate", description="Frames per second for the scene; 0 leaves the scene's own", default=0.0, min=0.0, max=1000.0
    )

    @reporting
    def execute(self, context):
        from ..bridge.scene import timeline as scene

        frames = sequence_object(context).refmesh.frames
        scene.set_timeline(context.scene, frames[0].scene_frame, frames[-1].scene_frame, self.fps)
        return {"FINISHED"}


class REFMESH_OT_go_to_frame(bpy.types.Operator):
    """Show this frame of the sequence"""

    bl_idname = "refmesh.go_to_frame"
    bl_label = "Go to Frame"
    bl_options = {"INTERNAL"}

    frame: StringProperty(name="Frame", description="Number as in the file names", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context):
        if sequence_object(context) is None:
            cls.poll_message_set(NO_SEQUENCE)
            return False
        return True  # also while a job is running, as it changes nothing

    @reporting
    def execute(self, context):
        frame = sequence_object(context).refmesh.frames.get(self.frame)
        if frame is None:
            raise RefMeshError(f"frame {self.frame} is not part of this sequence")
        context.scene.frame_set(frame.scene_frame)
        return {"FINISHED"}


CLASSES = (REFMESH_OT_set_timeline, REFMESH_OT_go_to_frame)
