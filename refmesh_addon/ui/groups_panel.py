"""Part of the Reference step: the groups of frames, where each begins, and what changes that."""

import bpy

from ..bridge.sequence.raw_sequence import frame_at
from ..properties.selection import sequence_object
from .layout import SequencePanel, draw_wrapped

ROWS = 5  # of the list, before it scrolls
MARKERS = "Groups begin at the markers of the timeline. If you do not see them, drag its upper edge up"


class REFMESH_UL_groups(bpy.types.UIList):
    """One line for each group, with the numbers of its frames' files; a click goes to its first frame."""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index):
        following = data.groups[index + 1].start if index + 1 < len(data.groups) else data.frames[-1].scene_frame + 1
        first, last = (frame_at(data.id_data, scene_frame).name for scene_frame in (item.start, following - 1))
        layout.label(text=f"{first} to {last}", icon="MARKER_HLT")
        if item.reference is not None:
            layout.label(text=f"{len(item.reference.data.polygons):,} triangles")


class REFMESH_PT_groups(SequencePanel, bpy.types.Panel):
    bl_label = "Groups of Frames"
    bl_parent_id = "REFMESH_PT_reference"

    @classmethod
    def poll(cls, context):
        owner = sequence_object(context)
        return owner is not None and len(owner.refmesh.groups) > 0

    def draw_header_preset(self, context):
        pass  # the page is that of the step

    def draw(self, context):
        layout, state = self.layout, sequence_object(context).refmesh
        layout.template_list("REFMESH_UL_groups", "", state, "groups", state, "active_group", rows=min(ROWS, len(state.groups)))
        active = min(state.active_group, len(state.groups) - 1)
        if active and state.groups[active].reason:
            draw_wrapped(layout, context, f"Why it begins there: {state.groups[active].reason}")
        draw_wrapped(layout, context, MARKERS, icon="INFO")
        layout.column(align=True).operator_enum("refmesh.edit_groups", "change")
