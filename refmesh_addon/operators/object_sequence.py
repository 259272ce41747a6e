"""Any animated mesh object in the scene as input: an Alembic or USD cache, a simulation, another add-on's sequence."""

import contextlib

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from ..core.errors import RefMeshError
from .common import SceneOperator, absolute, reporting
from .modal import ModalOperator

KINDS = ("MESH", "CURVE", "SURFACE", "META", "FONT")  # that Blender evaluates to a mesh
SOURCE = "source"  # folder in the output folder
AT_ONCE = 0.001  # seconds until the next frame; the window is drawn in between


class REFMESH_OT_import_object(ModalOperator, SceneOperator, bpy.types.Operator):
    """Take the active object, however it is animated, as a mesh sequence: its mesh in every frame is written to files"""

    bl_idname = "refmesh.import_object"
    bl_label = "Use Active Object"
    bl_options = {"UNDO"}

    output: StringProperty(
        name="Output",
        description="Folder for frames and results; empty takes one beside the saved scene",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    first: IntProperty(name="First Frame", description="Scene frame to begin with", default=1, min=0, options={"SKIP_SAVE"})
    last: IntProperty(name="Last Frame", description="Scene frame to end with", default=250, min=0, options={"SKIP_SAVE"})
    step: IntProperty(name="Frame Step", description="Take every so many frames", default=1, min=1, options={"SKIP_SAVE"})
    hide: BoolProperty(name="Hide Original", description="Hide the object, which the sequence then replaces", default=True)

    @classmethod
    def hindrance(cls, context):
        target = context.active_object
        if target is None or target.type not in KINDS:
            return "select the animated mesh object that is to become a sequence"
        if target.refmesh.frames or target.refmesh.sequence:
            return "this object belongs to a mesh sequence already; select another one"
        return super().hindrance(context)

    def invoke(self, context, event):
        scene = context.scene
        self.first, self.last, self.step = max(scene.frame_start, 0), max(scene.frame_end, 0), scene.frame_step
        return context.window_manager.invoke_props_dialog(self)

    @reporting
    def execute(self, context):
        from ..bridge.sequence.bake import bake

        target = context.active_object
        if self.last < self.first:
            raise RefMeshError(f"the last frame, {self.last}, is before the first, {self.first}")
        if not self.output and not bpy.data.filepath:
            raise RefMeshError("save the scene first, so that the frames can be written beside it, or choose an output folder")
        self._target, self._output = target.session_uid, absolute(self.output or f"//refmesh_{bpy.path.clean_name(target.name)}")
        self._numbers = range(self.first, self.last + 1, self.step)
        self._steps = bake(target, context.scene, self._numbers, self._output / SOURCE)
        if not bpy.app.background:
            return self.start_modal(context, AT_ONCE)
        for _ in self._steps:
            pass
        return self._finish(context)

    def modal(self, context, event):
        if event.type == "ESC" or self.cancel_wanted:
            self.cancel(context)
            self.report({"WARNING"}, "cancelled; nothing was written")
            return {"CANCELLED"}
        return self._advance(context) if event.type == "TIMER" else {"PASS_THROUGH"}

    @reporting
    def _advance(self, context):
        try:
            number = next(self._steps, None)
        except RefMeshError:
            self.end_modal(context)
            raise
        if number is None:
            self.end_modal(context)
            return self._finish(context)
        self.share = (self._numbers.index(number) + 1) / len(self._numbers)
        self.show_status(context, f"reading frame {number} of the scene, {self.share:.0%}")
        return {"RUNNING_MODAL"}

    def cancel(self, context):
        with contextlib.suppress(ReferenceError):  # another file is loaded and the scene is gone
            self._steps.close()
        self.end_modal(context)

    @reporting
    def _finish(self, context):
        from ..bridge.sequence.raw_sequence import new_sequence, read_frame
        from ..io.discovery import find_sequence

        target = next(candidate for candidate in bpy.data.objects if candidate.session_uid == self._target)
        first = next(iter(sorted((self._output / SOURCE).glob(f"{bpy.path.clean_name(target.name)}_*.ply"))))
        found = find_sequence(first)
        owner = new_sequence(context.scene, found, read_frame(found.frames[0].path, self._output), target.name)
        owner.refmesh.source, owner.refmesh.output = str(first), str(self._output)
        target.hide_set(self.hide)
        context.view_layer.objects.active = owner
        context.scene.frame_set(context.scene.frame_current)
        self.report({"INFO"}, f"{found.name}: {len(found.frames)} frames")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_import_object,)
