"""The RefMesh tab of the sidebar: the steps in order, each with its settings and its state."""

from dataclasses import fields

import bpy

from ..core.settings import PRESETS, Settings
from ..properties import sequence_object, title
from .preferences import draw_missing

WORST_SHOWN = 5  # frames listed with the largest distance


class RefMeshPanel:
    """Place shared by all panels of the tab."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RefMesh"


class REFMESH_PT_run(RefMeshPanel, bpy.types.Panel):
    bl_label = "RefMesh"

    def draw(self, context):
        layout = self.layout
        draw_missing(layout)
        owner = sequence_object(context)
        if owner is None:
            layout.label(text="No mesh sequence selected")
            layout.operator("refmesh.import_sequence", text="Import Sequence", icon="IMPORT")
            return
        current = owner.refmesh.settings.matching_preset()
        row = layout.row(align=True)
        for name in PRESETS:
            row.operator("refmesh.apply_preset", text=title(name), depress=name == current).preset = name
        layout.operator("refmesh.run_all", icon="PLAY")
        _draw_job(layout, context)


def _draw_job(layout, context):
    running = (operator for window in context.window_manager.windows for operator in window.modal_operators)
    for operator in running:
        if operator.bl_idname.startswith("REFMESH_OT_"):
            layout.progress(factor=operator.properties.share, text=operator.properties.status)
            layout.operator("refmesh.cancel", icon="CANCEL")


class StepPanel(RefMeshPanel):
    """A step: its settings, its button and whether its results are there."""

    stage = ""
    operators = ()

    @classmethod
    def poll(cls, context):
        return sequence_object(context) is not None

    def draw_header(self, context):
        done = self.stage in sequence_object(context).refmesh.done
        self.layout.label(icon="CHECKMARK" if done else "BLANK1")

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        state = sequence_object(context).refmesh
        for name in self.shown_settings():
            layout.prop(state.settings, name)
        for operator in self.operators:
            layout.operator(operator)

    @classmethod
    def shown_settings(cls):
        """Names of the settings of this stage."""
        return [setting.name for setting in fields(getattr(Settings, cls.stage))]


class REFMESH_PT_sequence(StepPanel, bpy.types.Panel):
    bl_label = "Sequence"

    def draw_header(self, context):
        self.layout.label(icon="CHECKMARK")

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        owner = sequence_object(context)
        state = owner.refmesh
        first, last = state.frames[0].name, state.frames[-1].name
        layout.label(text=f"{state.root.name if state.root else owner.name}: {len(state.frames)} frames, {first} to {last}")
        layout.prop(state, "frame_selection")
        layout.prop(state, "output")
        layout.operator("refmesh.load_results")


class REFMESH_PT_track(StepPanel, bpy.types.Panel):
    bl_label = "Track"
    stage = "tracking"
    operators = ("refmesh.track",)


class REFMESH_PT_reference(StepPanel, bpy.types.Panel):
    bl_label = "Reference"
    stage = "reference"
    operators = ("refmesh.extract_reference",)


class REFMESH_PT_deform(StepPanel, bpy.types.Panel):
    bl_label = "Deform"
    stage = "deformation"
    operators = ("refmesh.deform", "refmesh.evaluate")

    @classmethod
    def shown_settings(cls):
        return [*super().shown_settings(), *(setting.name for setting in fields(Settings.evaluation))]

    def draw(self, context):
        super().draw(context)
        measured = [frame for frame in sequence_object(context).refmesh.frames if frame.is_property_set("distance")]
        if measured:
            self.layout.label(text="Worst frames, mean distance in % of the diagonal")
        for frame in sorted(measured, key=lambda frame: -frame.distance)[:WORST_SHOWN]:
            self.layout.label(text=f"{frame.name}:  {100 * frame.distance:.3f} %")


class REFMESH_PT_export(StepPanel, bpy.types.Panel):
    bl_label = "Export"

    def draw_header(self, context):
        pass

    def draw(self, context):
        layout = self.layout
        layout.operator_menu_enum("refmesh.export", "format")
        layout.operator("refmesh.render_preview")


CLASSES = (REFMESH_PT_run, REFMESH_PT_sequence, REFMESH_PT_track, REFMESH_PT_reference, REFMESH_PT_deform, REFMESH_PT_export)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
