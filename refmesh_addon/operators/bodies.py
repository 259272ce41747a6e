"""Marks by which two bodies that touch all the time are separated in the reference mesh."""

import bpy
from bpy.props import IntProperty

from ..core.errors import RefMeshError
from ..core.reference.marks import parse_marks
from ..properties.selection import sequence_object
from .common import CentersOperator, object_mode, reporting

BODY_NUMBER = {"name": "Body", "min": 0, "options": {"SKIP_SAVE"}}


class REFMESH_OT_mark_body(CentersOperator, bpy.types.Operator):
    """Mark a body that always touches another one, by some of its centers, selected in edit mode: the two are then separate in \
the reference mesh"""

    bl_idname = "refmesh.mark_body"
    bl_label = "Mark Body"
    bl_options = {"UNDO"}

    body: IntProperty(description="Marked body to add the selected centers to; 0 marks a new one", **BODY_NUMBER)

    @classmethod
    def description(cls, context, properties):
        return f"Add the selected centers to body {properties.body}" if properties.body else cls.__doc__

    @reporting
    def execute(self, context):
        from ..bridge.results.bodies import mark_body

        owner = sequence_object(context)
        _check_number(owner, self.body)
        with object_mode(context):
            count = mark_body(owner, self.body - 1 if self.body else None, context.scene.frame_current)
        self.report({"INFO"}, "now mark another body" if count == 1 else f"{count} bodies are marked; run Reference to separate them")
        return {"FINISHED"}


class REFMESH_OT_forget_body(CentersOperator, bpy.types.Operator):
    """Remove the marks of a body"""

    bl_idname = "refmesh.forget_body"
    bl_label = "Remove Body"
    bl_options = {"UNDO"}

    body: IntProperty(description="Marked body to remove, counted from 1", **BODY_NUMBER)

    @reporting
    def execute(self, context):
        from ..bridge.results.bodies import forget_body

        owner = sequence_object(context)
        _check_number(owner, self.body or -1)
        with object_mode(context):
            forget_body(owner, self.body - 1)
        return {"FINISHED"}


def _check_number(owner: bpy.types.Object, body: int) -> None:
    """Raises RefMeshError for a body that is not marked; 0 is none and passes."""
    marks = parse_marks(owner.refmesh.settings.apart)
    there = len(marks.bodies) if marks else 0
    if not 0 <= body <= there:
        raise RefMeshError(f"there is no such marked body; {there or 'none'} marked so far")


CLASSES = (REFMESH_OT_mark_body, REFMESH_OT_forget_body)
