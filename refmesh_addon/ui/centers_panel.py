"""Part of the Track step: how the centers are shown."""

import bpy

from ..properties.selection import sequence_object
from .layout import CentersPanel, draw_wrapped


class REFMESH_PT_centers(CentersPanel, bpy.types.Panel):
    bl_label = "Centers"
    bl_parent_id = "REFMESH_PT_track"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        state = sequence_object(context).refmesh
        layout.prop(state, "center_color")
        if state.center_range:
            draw_wrapped(layout, context, state.center_range, icon="COLOR")
        layout.prop(state, "center_size", slider=True)
        row = layout.row(align=True)
        row.operator("refmesh.show_trails", icon="CURVE_PATH")
        row.operator("refmesh.remove_trails", text="", icon="X")
