"""The Export step."""

import bpy

from ..bridge.results.status import first_to_run
from ..properties.selection import sequence_object
from .layout import SequencePanel


class REFMESH_PT_export(SequencePanel, bpy.types.Panel):
    bl_label = "Export"

    def draw(self, context):
        layout = self.layout
        state = sequence_object(context).refmesh
        first = first_to_run(state, "deformation")
        layout.label(text=f"Run {first} first" if first else f"Uses {len(state.groups)} deformed meshes", icon="IMPORT")
        layout.operator_menu_enum("refmesh.export", "format")
        layout.operator("refmesh.render_preview")
