"""Operators that go on while the window stays alive: a timer, progress in status bar and panel, Esc and a Cancel button."""

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from .common import running_job

POLL_INTERVAL = 0.1  # seconds between two looks at a worker
INNER = {"options": {"HIDDEN", "SKIP_SAVE"}}


class ModalOperator:
    """What the panel needs to show of any operator that takes its time."""

    share: FloatProperty(name="Done", description="Part of the job that is done", **INNER)
    status: StringProperty(name="Status", description="What the job is doing", **INNER)
    cancel_wanted: BoolProperty(name="Cancel", description="Stop the job at its next step", **INNER)

    def start_modal(self, context, interval):
        self._timer = context.window_manager.event_timer_add(interval, window=context.window)
        context.window_manager.modal_handler_add(self)
        self.show_status(context, "starting")
        return {"RUNNING_MODAL"}

    def end_modal(self, context):
        context.window_manager.event_timer_remove(self._timer)
        self.show_status(context, None)

    def show_status(self, context, words, hint=" (Esc cancels)"):
        """In the status bar and, through `status`, in the panel; None gives the status bar back to Blender."""
        self.status = words or ""
        for window in context.window_manager.windows:
            window.workspace.status_text_set(words and f"RefMesh: {words}{hint}")
            for region in (region for area in window.screen.areas if area.type == "VIEW_3D" for region in area.regions):
                if region.type == "UI":
                    region.tag_redraw()


class REFMESH_OT_cancel(bpy.types.Operator):
    """Stop the running job; what is finished is kept"""

    bl_idname = "refmesh.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context):
        if running_job(context) is None:
            cls.poll_message_set("no RefMesh job is running")
            return False
        return True

    def execute(self, context):
        running_job(context).properties.cancel_wanted = True
        return {"FINISHED"}


CLASSES = (REFMESH_OT_cancel,)
