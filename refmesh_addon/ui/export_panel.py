"""The Export step."""

import bpy

from ..bridge.formats.registry import written_formats
from ..bridge.results.status import export_note
from ..core.counted import counted
from ..properties.selection import sequence_object
from .layout import SequencePanel, draw_wrapped


class REFMESH_MT_export(bpy.types.Menu):
    """The formats; those that this Blender cannot write are grayed out and say why"""

    bl_label = "Export"

    def draw(self, context):
        layout = self.layout
        layout.operator_context = "INVOKE_DEFAULT"
        for known in written_formats():
            reason = known.unavailable()
            row = layout.row()
            row.enabled = not reason
            row.operator("refmesh.export", text=f"{known.label}: {reason}" if reason else known.label).format = known.name


class REFMESH_PT_export(SequencePanel, bpy.types.Panel):
    bl_label = "Export"

    def draw_header(self, context):
        self.layout.label(icon="EXPORT")

    def draw(self, context):
        layout = self.layout
        state = sequence_object(context).refmesh
        deformed = "deformation" in state.done
        note = export_note(state) if deformed else "Run Deform first"
        writes = f"Writes {counted(len(state.groups), 'deformed mesh', 'deformed meshes')}"
        draw_wrapped(layout, context, note or writes, icon="ERROR" if note else "IMPORT")
        column = layout.column()
        column.enabled = deformed
        column.label(text="Quality of Small Files")
        column.prop(state, "export_quality", text="")
        if state.export_estimates:
            for line in state.export_estimates.splitlines():
                draw_wrapped(column, context, line)
        else:
            column.operator("refmesh.estimate_export", icon="VIEWZOOM")
        column.menu("REFMESH_MT_export", icon="EXPORT")
        if state.exported:
            draw_wrapped(column, context, f"Written: {state.exported}")
        column.operator("refmesh.render_preview", icon="RENDER_STILL")
        row = layout.row()
        row.operator("refmesh.export_job", icon="NETWORK_DRIVE")
        row.operator("refmesh.clean_cache", icon="TRASH")
