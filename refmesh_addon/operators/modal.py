"""Modal operators: a timer, progress in status bar and panel, and what cancels them."""

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from .common import running_job

POLL_INTERVAL = 0.1  # seconds
TAB = "RefMesh"  # the category of our panels in the sidebar
HINT = " (Esc with the pointer here or over the RefMesh tab cancels)"
INTERNAL = {"options": {"HIDDEN", "SKIP_SAVE"}}


class ModalOperator:
    """The state of a modal operator that the panel shows, and the timer that drives it."""

    progress: FloatProperty(name="Progress", description="Share of the job that is done", **INTERNAL)
    status: StringProperty(name="Status", description="What the job is doing", **INTERNAL)
    at_stake: StringProperty(name="At Stake", description="What to say before the job is canceled; empty cancels at once", **INTERNAL)
    cancel_requested: BoolProperty(name="Cancel", description="Stop the job at its next step", **INTERNAL)

    _timer = None  # Blender calls `cancel` also where the dialog before the job was closed

    def start_modal(self, context, interval):
        self._timer = context.window_manager.event_timer_add(interval, window=context.window)
        context.window_manager.modal_handler_add(self)
        self.show_status(context, "starting")
        return {"RUNNING_MODAL"}

    def end_modal(self, context):
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
            self.show_status(context, None)

    def escaped(self, context, event) -> bool:
        """Whether the event is an Esc meant for the job; asks, where that costs something, and passes on an Esc meant for Blender."""
        if event.type != "ESC" or event.value != "PRESS" or not over_progress(context.window, event.mouse_x, event.mouse_y):
            return False
        bpy.ops.refmesh.cancel("INVOKE_DEFAULT")
        return True

    def show_status(self, context, text, hint=HINT):
        """Shows text in the status bar and, through `status`, in the panel; None gives the status bar back to Blender."""
        self.status = text or ""
        for window in context.window_manager.windows:
            window.workspace.status_text_set(text and f"RefMesh: {text}{hint}")
            for region in (region for area in window.screen.areas if area.type == "VIEW_3D" for region in area.regions):
                if region.type == "UI":
                    region.tag_redraw()


def over_progress(window: bpy.types.Window, x: int, y: int) -> bool:
    """Whether a place in a window, in pixels, is where progress is shown: in the status bar or in the RefMesh tab of a sidebar."""
    areas = window.screen.areas
    if y < min(area.y for area in areas):  # the status bar is not an area of the screen: it lies below all of them
        return True
    sidebars = [region for area in areas if area.type == "VIEW_3D" for region in area.regions if region.type == "UI"]
    return any(_holds(region, x, y) and region.active_panel_category == TAB for region in sidebars)


def _holds(region: bpy.types.Region, x: int, y: int) -> bool:
    return 0 <= x - region.x < region.width and 0 <= y - region.y < region.height


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

    def invoke(self, context, event):
        at_stake = running_job(context).properties.at_stake
        if not at_stake:
            return self.execute(context)
        return context.window_manager.invoke_confirm(
            self, event, title="Stop the job?", message=at_stake, confirm_text="Stop Job", icon="QUESTION"
        )

    def execute(self, context):
        job = running_job(context)
        if job is not None:  # it may have ended while the question was open
            job.properties.cancel_requested = True
        return {"FINISHED"}


CLASSES = (REFMESH_OT_cancel,)
