"""Corrections of the deformed meshes by hand, which hold in all frames of a group or in some of them."""

import bpy
from bpy.props import BoolProperty, IntProperty

from ..core.errors import RefMeshError
from ..properties.selection import edited_group, sequence_object
from .common import OBJECT_MODE_FIRST, SequenceOperator, reporting


class CorrectionOperator(SequenceOperator):
    """Works on the group of the active deformed mesh, else of the current frame, in whatever mode the mesh is."""

    bl_options = {"UNDO"}

    @classmethod
    def poll_failure(cls, context) -> str:
        failure = super().poll_failure(context)
        owner = sequence_object(context)
        edited = edited_group(context)
        if failure in ("", OBJECT_MODE_FIRST) and (edited is None or not owner.refmesh.groups[edited].deformed):
            return "there is no deformed mesh yet; run the Deform step first"
        if failure == OBJECT_MODE_FIRST and context.active_object == owner.refmesh.groups[edited].deformed:
            return ""
        return failure

    @reporting
    def execute(self, context):
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        return self.change(context, sequence_object(context), edited_group(context))


class REFMESH_OT_edit_shape(CorrectionOperator, bpy.types.Operator):
    """Hold the deformed mesh still in this frame, so that it can be sculpted or edited; Apply Edit then makes it a correction"""

    bl_idname = "refmesh.edit_shape"
    bl_label = "Edit Shape"

    def change(self, context, owner, index):
        from ..bridge.results.corrections import begin_edit

        member = begin_edit(owner, index, context.scene.frame_current)
        owner.refmesh.show_result = True
        context.view_layer.update()
        for selected in context.selected_objects:
            selected.select_set(False)
        context.view_layer.objects.active = member
        if member.visible_get():
            member.select_set(True)
        self.report({"INFO"}, "sculpt or edit the mesh, then press Apply Edit")
        return {"FINISHED"}


class REFMESH_OT_apply_edit(CorrectionOperator, bpy.types.Operator):
    """Turn what was changed on the deformed mesh, by moving vertices, sculpting or shape keys, into a correction that follows the \
surface through the frames"""

    bl_idname = "refmesh.apply_edit"
    bl_label = "Apply Edit"

    whole_group: BoolProperty(name="Whole Group", description="The correction applies to all frames of the group", default=True)
    first: IntProperty(name="First Frame", description="Scene frame from which it applies in full; 0 takes the current one", min=0)
    last: IntProperty(name="Last Frame", description="Scene frame up to which it applies in full; 0 takes the current one", min=0)
    fade: IntProperty(name="Fade", description="Frames over which it fades in before and fades out after", min=0)

    def change(self, context, owner, index):
        from ..bridge.results.corrections import apply_edit

        current = context.scene.frame_current
        first, last = self.first or current, self.last or current
        if self.whole_group:
            first, last = owner.refmesh.frames[0].scene_frame, owner.refmesh.frames[-1].scene_frame
        if last < first:
            raise RefMeshError(f"the last frame, {last}, is before the first, {first}")
        moved = apply_edit(owner, index, current, (first, last, 0 if self.whole_group else self.fade))
        self.report({"INFO"}, f"correction of {moved} vertices in group {index}")
        return {"FINISHED"}


class REFMESH_OT_discard_edit(CorrectionOperator, bpy.types.Operator):
    """Let the deformed mesh play again, without what was changed since Edit Shape"""

    bl_idname = "refmesh.discard_edit"
    bl_label = "Discard Edit"

    def change(self, context, owner, index):
        from ..bridge.results.corrections import discard_edit

        discard_edit(owner, index)
        return {"FINISHED"}


class REFMESH_OT_remove_correction(CorrectionOperator, bpy.types.Operator):
    """Remove the correction that is active in the list"""

    bl_idname = "refmesh.remove_correction"
    bl_label = "Remove Correction"

    def change(self, context, owner, index):
        from ..bridge.results.corrections import remove_correction

        group = owner.refmesh.groups[index]
        if not group.corrections:
            raise RefMeshError(f"group {index} has no corrections")
        remove_correction(owner, index, min(group.active_correction, len(group.corrections) - 1))
        return {"FINISHED"}


CLASSES = (REFMESH_OT_edit_shape, REFMESH_OT_apply_edit, REFMESH_OT_discard_edit, REFMESH_OT_remove_correction)
