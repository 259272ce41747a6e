"""The settings of a step: those that matter first, the others in a part that is folded."""

import bpy

from ..core.settings import flat_fields, setting_names
from ..properties.selection import sequence_object
from .layout import SequencePanel

# Shown at once; every other setting of a stage is in its Advanced part.
FIRST = {
    "tracking": ("surface", "centers", "resolution"),
    "reference": ("segments", "segment_frames", "group_size", "triangles"),
    "deformation": ("fit_rounds", "smoothness"),
    "color": ("texture", "exposure", "color_drift", "texture_format"),
}
ELSEWHERE = {"apart"}  # settings that have a panel of their own
# Setting -> the setting and the value without which it has no effect.
NEEDS = {"segment_frames": ("segments", "frames"), "longest_group": ("group_size", 0)}
LABELS = 0.45  # of the width of a panel
_AUTOMATIC = {item.name for item in flat_fields() if item.metadata["manual"] is not None}


def draw_settings(layout, settings, names) -> None:
    """A row for each setting that has an effect: its label, and its value or Auto."""
    for name in names:
        needed = NEEDS.get(name)
        if needed is None or getattr(settings, needed[0]) == needed[1]:
            _draw_setting(layout, settings, name)


def _draw_setting(layout, settings, name: str) -> None:
    row = layout.split(factor=LABELS)
    label = row.row()
    label.alignment = "RIGHT"
    label.label(text=settings.bl_rna.properties[name].name)
    value = row.row(align=True)
    if name in _AUTOMATIC:
        switch = f"auto_{name}"
        value.prop(settings, switch, text="Auto", toggle=True)
        if getattr(settings, switch):
            return
    value.prop(settings, name, text="")


class AdvancedPanel(SequencePanel):
    """The settings of a step that most people leave alone; folded."""

    bl_label = "Advanced"
    bl_options = {"DEFAULT_CLOSED"}
    stages = ()

    def draw_header_preset(self, context):
        pass  # the page is that of the step

    def draw(self, context):
        first = {name for names in FIRST.values() for name in names}
        for stage in self.stages:
            names = [name for name in setting_names(stage) if name not in first | ELSEWHERE]
            draw_settings(self.layout, sequence_object(context).refmesh.settings, names)


class REFMESH_PT_track_advanced(AdvancedPanel, bpy.types.Panel):
    bl_parent_id = "REFMESH_PT_track"
    stages = ("tracking",)


class REFMESH_PT_reference_advanced(AdvancedPanel, bpy.types.Panel):
    bl_parent_id = "REFMESH_PT_reference"
    stages = ("reference",)


class REFMESH_PT_deform_advanced(AdvancedPanel, bpy.types.Panel):
    bl_parent_id = "REFMESH_PT_deform"
    stages = ("deformation", "evaluation")


CLASSES = (REFMESH_PT_track_advanced, REFMESH_PT_reference_advanced, REFMESH_PT_deform_advanced)
