"""Part of the Reference step: bodies that touch all the time, marked to be apart."""

import bpy

from ..core.errors import RefMeshError
from ..core.reference.marks import parse_marks
from ..properties import sequence_object
from .layout import CentersPanel, draw_wrapped

HOW = "Where two bodies touch all the time: select some centers of one in edit mode and mark them, then of the other"


class REFMESH_PT_bodies(CentersPanel, bpy.types.Panel):
    bl_label = "Bodies Apart"
    bl_parent_id = "REFMESH_PT_reference"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        try:
            marks = parse_marks(sequence_object(context).refmesh.settings.apart)
        except RefMeshError as error:
            draw_wrapped(layout, context, str(error), icon="ERROR")
            marks = None
        bodies = marks.bodies if marks else ()
        if len(bodies) < 2:
            draw_wrapped(layout, context, HOW if not bodies else "Mark another body that this one is to be apart from", icon="INFO")
        for number, points in enumerate(bodies, 1):
            row = layout.row(align=True)
            count = f"{len(points)} center{'s' if len(points) > 1 else ''}"
            row.label(text=f"Body {number}: {count}, frame {marks.frame}", icon="OUTLINER_OB_POINTCLOUD")
            row.operator("refmesh.mark_body", text="", icon="ADD").body = number
            row.operator("refmesh.forget_body", text="", icon="X").body = number
        layout.operator("refmesh.mark_body").body = 0
