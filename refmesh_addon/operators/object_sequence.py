"""Any animated mesh object as input: an Alembic or USD cache, a simulation, a sequence of another add-on."""

import contextlib

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from ..core.counted import counted
from ..core.errors import RefMeshError
from ..io.sequence import BAKED_FOLDER
from .common import SceneOperator, absolute, reporting
from .modal import ModalOperator

OBJECT_TYPES = ("MESH", "CURVE", "SURFACE", "META", "FONT")  # that Blender evaluates to a mesh
MANY_FRAMES = 100  # read so far: from here on it asks before it drops them
FRAME_INTERVAL = 0.001  # seconds between two frames, in which the window is drawn


class REFMESH_OT_import_object(ModalOperator, SceneOperator, bpy.types.Operator):
    """Turn the active object, however it is animated, into a mesh sequence: its mesh in every frame is written to a file"""

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
    step: IntProperty(name="Frame Step", description="Take every Nth frame", default=1, min=1, options={"SKIP_SAVE"})
    hide: BoolProperty(name="Hide Original", description="Hide the object, which the sequence then replaces", default=True)

    _frames = None  # numbers of the scene frames as they are read

    @classmethod
    def poll_failure(cls, context):
        target = context.active_object
        if target is None or target.type not in OBJECT_TYPES:
            return "select the animated mesh object to turn into a sequence"
        if target.refmesh.frames or target.refmesh.sequence:
            return "this object belongs to a mesh sequence already; select another one"
        return super().poll_failure(context)

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
        self._frames = bake(target, context.scene, self._numbers, self._output / BAKED_FOLDER)
        if not bpy.app.background:
            return self.start_modal(context, FRAME_INTERVAL)
        for _ in self._frames:
            pass
        return self._finish(context)

    def modal(self, context, event):
        if self.escaped(context, event):
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if not self.cancel_requested:
            return self._advance(context)
        self.cancel(context)
        self.report({"WARNING"}, "canceled; nothing was written")
        return {"CANCELLED"}

    @reporting
    def _advance(self, context):
        try:
            number = next(self._frames, None)
        except RefMeshError:
            self.end_modal(context)
            raise
        if number is None:
            self.end_modal(context)
            return self._finish(context)
        self.progress = (self._numbers.index(number) + 1) / len(self._numbers)
        self.at_stake = _at_stake(self._numbers.index(number) + 1)
        self.show_status(context, f"reading frame {number} of the scene, {self.progress:.0%}")
        return {"RUNNING_MODAL"}

    def cancel(self, context):
        """Called by Blender when it ends the operator: its dialog is closed, another file is loaded, or Blender quits."""
        if self._frames is not None:
            with contextlib.suppress(ReferenceError):  # another file is loaded and the scene is gone
                self._frames.close()
        self.end_modal(context)

    @reporting
    def _finish(self, context):
        from ..bridge.scene.paths import stored_path
        from ..bridge.sequence.raw_sequence import new_sequence, read_frame
        from ..io.discovery import find_sequence

        target = next(candidate for candidate in bpy.data.objects if candidate.session_uid == self._target)
        first = next(iter(sorted((self._output / BAKED_FOLDER).glob(f"{bpy.path.clean_name(target.name)}_*.ply"))))
        sequence = find_sequence(first)
        owner = new_sequence(context.scene, sequence, read_frame(sequence.frames[0].path, self._output), target.name)
        owner.refmesh.source, owner.refmesh.output = stored_path(first), stored_path(self._output)
        target.hide_set(self.hide)
        context.view_layer.objects.active = owner
        context.scene.frame_set(context.scene.frame_current)
        self.report({"INFO"}, f"{sequence.name}: {counted(len(sequence.frames), 'frame')}")
        return {"FINISHED"}


def _at_stake(count: int) -> str:
    return f"The {count} frames read so far are dropped" if count >= MANY_FRAMES else ""


CLASSES = (REFMESH_OT_import_object,)
