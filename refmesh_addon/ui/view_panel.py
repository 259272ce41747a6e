"""Which kinds of objects are seen."""

import bpy

from ..properties.selection import sequence_object
from .layout import RefMeshPanel


class REFMESH_PT_view(RefMeshPanel, bpy.types.Panel):
    bl_label = "Show"
    bl_parent_id = "REFMESH_PT_run"

    @classmethod
    def poll(cls, context):
        owner = sequence_object(context)
        return owner is not None and owner.refmesh.centers is not None

    def draw(self, context):
        state = sequence_object(context).refmesh
        grid = self.layout.grid_flow(columns=2, even_columns=True, align=True)
        for kind in ("source", "result", "centers", "reference"):
            shown = getattr(state, f"show_{kind}")
            grid.prop(state, f"show_{kind}", toggle=True, icon="HIDE_OFF" if shown else "HIDE_ON")
