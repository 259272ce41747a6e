"""Part of the Deform step: corrections by hand."""

import bpy

from ..properties.selection import edited_group, sequence_object
from .layout import RefMeshPanel

ROWS = 3


class REFMESH_UL_corrections(bpy.types.UIList):
    """One line for each correction: its name and whether it is shown."""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index):
        layout.prop(item, "name", text="", emboss=False)
        layout.prop(item, "mute", text="", icon="HIDE_ON" if item.mute else "HIDE_OFF", emboss=False)


class REFMESH_PT_corrections(RefMeshPanel, bpy.types.Panel):
    bl_label = "Corrections"
    bl_parent_id = "REFMESH_PT_deform"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        owner, index = sequence_object(context), edited_group(context)
        return index is not None and owner.refmesh.groups[index].deformed is not None

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        group = sequence_object(context).refmesh.groups[edited_group(context)]
        row = layout.row(align=True)
        if group.is_edited:
            row.operator("refmesh.apply_edit", icon="CHECKMARK")
            row.operator("refmesh.discard_edit", text="", icon="X")
        else:
            row.operator("refmesh.edit_shape", icon="SCULPTMODE_HLT")
            row.operator("refmesh.apply_edit")
        if not group.corrections:
            return
        row = layout.row()
        row.template_list("REFMESH_UL_corrections", "", group, "corrections", group, "active_correction", rows=ROWS)
        row.operator("refmesh.remove_correction", text="", icon="REMOVE")
        item = group.corrections[min(group.active_correction, len(group.corrections) - 1)]
        for name in ("first", "last", "fade"):
            layout.prop(item, name)
