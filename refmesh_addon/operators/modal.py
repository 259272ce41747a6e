"""Modal operators: a timer, progress in status bar and panel, Esc and a Cancel button."""

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from .common import running_job

POLL_INTERVAL = 0.1  # seconds
INTERNAL = {"options": {"HIDDEN", "SKIP_SAVE"}}


class ModalOperator:
    """The state of a modal operator that the panel shows, and the timer that drives it."""

    progress: FloatProperty(name="Progress", description="Share of the job that is done", **INTERNAL)
    status: StringProperty(name="Status", description="What the job is doing", **INTERNAL)
    cancel_requested: BoolProperty(name="Cancel", description="Stop the job at its next step", **INTERNAL)

    def start_modal(self, context, interval):
        self._timer = context.window_manager.event_timer_add(interval, window=context.window)
        context.window_manager.modal_handler_add(self)
        self.show_status(context, "starting")
        return {"RUNNING_MODAL"}

    def end_modal(self, context):
        context.window_manager.event_timer_remove(self._timer)
        self.show_status(context, None)

    def show_status(self, context, text, hint=" (Esc cancels)"):
        """Shows text in the status bar and, through `status`, in the panel; None gives the status bar back to Blender."""
        self.status = text or ""
        for window in context.window_manager.windows:
            window.workspace.status_text_set(text and f"RefMesh: {text}{hint}")
            for region in (region for area in window.screen.areas if area.type == "VIEW_3D" for region in area.regions):
                if region.type == "UI":
                    region.tag_redraw()


class REFMESH_OT_cancel(bpy.types.Operator):
    """Stop the running job; finished results are kept"""

    bl_idname = "refmesh.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context):
        if running_job(context) is None:
            cls.poll_message_set("no RefMesh job is running")
            return False
        return True

    def execute(self, context):
        running_job(context).properties.cancel_requested = True
        return {"FINISHED"}


CLASSES = (REFMESH_OT_cancel,)
