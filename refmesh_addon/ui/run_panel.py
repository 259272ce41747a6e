"""The first panel of the tab: presets, the button that runs every step, and the progress of a job."""

import bpy

from ..bridge.results.missing import linked_note
from ..bridge.results.status import first_to_run
from ..core.presets import PRESET_TITLES
from ..properties.selection import sequence_object
from .first_start import missing_essentials
from .layout import RefMeshPanel, draw_wrapped


class REFMESH_PT_run(RefMeshPanel, bpy.types.Panel):
    bl_label = "RefMesh"

    def draw(self, context):
        layout = self.layout
        needed = missing_essentials()
        if needed:
            draw_wrapped(layout, context, needed, icon="ERROR")
        owner = sequence_object(context)
        if owner is None:
            layout.label(text="No mesh sequence selected")
            layout.operator("refmesh.import_sequence", text="Import Sequence", icon="IMPORT")
            layout.operator("refmesh.import_object", icon="OUTLINER_OB_MESH")
            return
        if linked_note(owner):
            draw_wrapped(layout, context, linked_note(owner), icon="LINKED")
            return
        if owner.refmesh.missing:
            draw_wrapped(layout, context, owner.refmesh.missing, icon="ERROR")
        preset = PRESET_TITLES.get(owner.refmesh.settings.matching_preset(), "Custom")
        layout.operator_menu_enum("refmesh.apply_preset", "preset", text=f"Preset: {preset}", icon="PRESET")
        layout.operator("refmesh.run_all", icon="PLAY")
        if not _draw_job(layout, context):
            first = first_to_run(owner.refmesh, "color")
            layout.label(text=f"Begins with {first}" if first else "Everything is up to date", icon="BLANK1" if first else "CHECKMARK")


def _draw_job(layout, context) -> bool:
    """Draws the progress of the running job; returns whether there is one."""
    running = (operator for window in context.window_manager.windows for operator in window.modal_operators)
    for operator in running:
        if operator.bl_idname.startswith("REFMESH_OT_"):
            layout.progress(factor=operator.properties.progress, text=operator.properties.status)
            layout.operator("refmesh.cancel", icon="CANCEL")
            return True
    return False
