"""Part of the Reference step: the bodies that the take shows, and marks that separate bodies which touch all the time."""

import bpy

from ..core.counted import counted
from ..core.errors import RefMeshError
from ..core.reference.marks import parse_marks
from ..properties.selection import sequence_object
from ..properties.wording import for_window
from .layout import CentersPanel, draw_wrapped

INSTRUCTIONS = "Where two bodies touch all the time: in edit mode, select some centers of one and mark them, then of the other"


class REFMESH_PT_bodies(CentersPanel, bpy.types.Panel):
    bl_label = "Bodies Apart"
    bl_parent_id = "REFMESH_PT_reference"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, state = self.layout, sequence_object(context).refmesh
        for line in state.bodies.splitlines():
            draw_wrapped(layout, context, line, icon="POINTCLOUD_DATA")
        try:
            marks = parse_marks(state.settings.apart)
        except RefMeshError as error:
            draw_wrapped(layout, context, for_window(str(error)), icon="ERROR")
            marks = None
        bodies = marks.bodies if marks else ()
        if len(bodies) < 2:
            draw_wrapped(layout, context, INSTRUCTIONS if not bodies else "Mark another body to separate it from this one", icon="INFO")
        for number, points in enumerate(bodies, 1):
            row = layout.row(align=True)
            row.label(text=f"Body {number}: {counted(len(points), 'center')}, frame {marks.frame}", icon="OUTLINER_OB_POINTCLOUD")
            row.operator("refmesh.mark_body", text="", icon="ADD").body = number
            row.operator("refmesh.forget_body", text="", icon="X").body = number
        layout.operator("refmesh.mark_body").body = 0
