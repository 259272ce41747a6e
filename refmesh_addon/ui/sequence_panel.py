"""The Sequence step: the frames, and the findings of the check."""

import bpy

from ..bridge.scene.focus import longest_side
from ..core.capture.scale import scale_note
from ..core.counted import counted
from ..core.findings import SEVERITIES
from ..properties.selection import sequence_object
from .layout import SequencePanel, draw_wrapped

ICONS = {"error": "CANCEL", "warning": "ERROR", "note": "INFO"}
ROWS = 5  # of the list of findings, before it scrolls


class REFMESH_UL_findings(bpy.types.UIList):
    """One line for each finding; a click goes to its frame."""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index):
        layout.label(text=f"{item.name}: {item.message}", icon=ICONS.get(item.severity, "INFO"))


class REFMESH_PT_sequence(SequencePanel, bpy.types.Panel):
    bl_label = "Sequence"

    def draw_header(self, context):
        self.layout.label(icon="SEQUENCE")

    def draw_header_preset(self, context):
        state = sequence_object(context).refmesh
        worst = next((severity for severity in SEVERITIES if any(item.severity == severity for item in state.findings)), "")
        self.layout.label(icon="CHECKMARK" if state.checked and worst in ("", "note") else ICONS.get(worst, "BLANK1"))
        super().draw_header_preset(context)

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        owner = sequence_object(context)
        state = owner.refmesh
        first, last = state.frames[0].name, state.frames[-1].name
        layout.label(text=f"{state.root.name if state.root else owner.name}: {counted(len(state.frames), 'frame')}, {first} to {last}")
        row = layout.row(align=True)
        row.prop(state, "frame_selection")
        row.operator("refmesh.exclude_frame", text="", icon="REMOVE")
        row = layout.row(align=True)
        row.prop(state, "source")
        row.operator("refmesh.reload_frames", text="", icon="FILE_REFRESH")
        layout.prop(state, "output")
        layout.prop(state, "source_colors")
        self._draw_check(context, state)
        layout.operator("refmesh.set_timeline", icon="TIME")
        layout.operator("refmesh.load_results", icon="FILE_FOLDER")

    def _draw_check(self, context, state):
        layout = self.layout
        layout.operator("refmesh.check_sequence", icon="VIEWZOOM")
        owner = state.id_data
        note = scale_note(longest_side(owner, context.scene)) if state.root else ""
        if note and not state.checked:  # the findings of the check have it as well
            draw_wrapped(layout, context, note, icon="CON_SIZELIMIT")
        if note:
            layout.operator("refmesh.scale_sequence")
        if not state.checked:
            layout.label(text="Frames not checked yet", icon="QUESTION")
        elif not state.findings:
            layout.label(text="Every frame was checked: no findings", icon="CHECKMARK")
        else:
            layout.template_list("REFMESH_UL_findings", "", state, "findings", state, "active_finding", rows=min(ROWS, len(state.findings)))
            finding = state.findings[min(state.active_finding, len(state.findings) - 1)]
            draw_wrapped(layout, context, f"Frame {finding.name}: {finding.message}. {SEVERITIES.get(finding.severity, '')}.")
