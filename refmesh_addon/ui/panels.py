"""The RefMesh tab of the sidebar: what runs everything, then the steps in order, each with its settings and its state."""

from dataclasses import fields

import bpy

from ..bridge.results.status import first_to_run, step_status
from ..core.settings import PRESETS, Settings
from ..properties import sequence_object, title
from .bodies_panel import REFMESH_PT_bodies
from .layout import CentersPanel, RefMeshPanel, SequencePanel, draw_wrapped, seconds_in_words
from .preferences import draw_missing
from .sequence_panel import CLASSES as SEQUENCE_CLASSES

WORST_SHOWN = 5  # frames listed with the largest distance
STATUS_ICONS = {"never": "BLANK1", "current": "CHECKMARK", "stale": "FILE_REFRESH"}


class REFMESH_PT_run(RefMeshPanel, bpy.types.Panel):
    bl_label = "RefMesh"

    def draw(self, context):
        layout = self.layout
        draw_missing(layout)
        owner = sequence_object(context)
        if owner is None:
            layout.label(text="No mesh sequence selected")
            layout.operator("refmesh.import_sequence", text="Import Sequence", icon="IMPORT")
            layout.operator("refmesh.import_object", icon="OUTLINER_OB_MESH")
            return
        if owner.refmesh.missing:
            draw_wrapped(layout, context, owner.refmesh.missing, icon="ERROR")
        current = owner.refmesh.settings.matching_preset()
        row = layout.row(align=True)
        for name in PRESETS:
            row.operator("refmesh.apply_preset", text=title(name), depress=name == current).preset = name
        layout.operator("refmesh.run_all", icon="PLAY")
        if not _draw_job(layout, context):
            first = first_to_run(owner.refmesh, "evaluation")
            layout.label(text=f"Begins with {first}" if first else "Everything is up to date", icon="BLANK1" if first else "CHECKMARK")


def _draw_job(layout, context) -> bool:
    """The progress of the job that runs, if one does."""
    running = (operator for window in context.window_manager.windows for operator in window.modal_operators)
    for operator in running:
        if operator.bl_idname.startswith("REFMESH_OT_"):
            layout.progress(factor=operator.properties.share, text=operator.properties.status)
            layout.operator("refmesh.cancel", icon="CANCEL")
            return True
    return False


class StepPanel(SequencePanel):
    """A step: what it uses, its settings, its button, and whether its results are those of the settings."""

    stage = ""
    operators = ()

    def draw_header(self, context):
        self.layout.label(icon=STATUS_ICONS[step_status(sequence_object(context).refmesh, self.stage).kind])

    def draw_header_preset(self, context):
        seconds = step_status(sequence_object(context).refmesh, self.stage).seconds
        if seconds:
            self.layout.label(text=seconds_in_words(seconds))
        super().draw_header_preset(context)

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        state = sequence_object(context).refmesh
        layout.label(text=f"Uses {self.uses(state)}", icon="IMPORT")
        for name in self.shown_settings():
            layout.prop(state.settings, name)
        for operator in self.operators:
            layout.operator(operator)
        status = step_status(state, self.stage)
        draw_wrapped(layout, context, status.words[0].upper() + status.words[1:], icon=STATUS_ICONS[status.kind])

    @staticmethod
    def uses(state) -> str:
        """What the step works on."""
        raise NotImplementedError

    @classmethod
    def shown_settings(cls):
        """Names of the settings of this stage."""
        return [setting.name for setting in fields(getattr(Settings, cls.stage))]


class REFMESH_PT_track(StepPanel, bpy.types.Panel):
    bl_label = "Track"
    stage = "tracking"
    operators = ("refmesh.track",)

    @staticmethod
    def uses(state):
        return f"frames {state.frame_selection}" if state.frame_selection else f"all {len(state.frames)} frames"


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


class REFMESH_PT_reference(StepPanel, bpy.types.Panel):
    bl_label = "Reference"
    stage = "reference"
    operators = ("refmesh.extract_reference",)

    @classmethod
    def shown_settings(cls):
        return [name for name in super().shown_settings() if name != "apart"]  # which has a panel of its own below

    def draw(self, context):
        super().draw(context)
        if len(sequence_object(context).refmesh.groups):
            self.layout.column(align=True).operator_enum("refmesh.edit_groups", "change")

    @staticmethod
    def uses(state):
        first = first_to_run(state, "tracking")
        return "the centers of Track, which runs first" if first else f"{state.settings.centers} tracked centers"


class REFMESH_PT_deform(StepPanel, bpy.types.Panel):
    bl_label = "Deform"
    stage = "deformation"
    operators = ("refmesh.deform", "refmesh.evaluate")

    @staticmethod
    def uses(state):
        first = first_to_run(state, "reference")
        return f"the meshes of Reference; {first} runs first" if first else f"{len(state.groups)} reference meshes"

    @classmethod
    def shown_settings(cls):
        return [*super().shown_settings(), *(setting.name for setting in fields(Settings.evaluation))]

    def draw(self, context):
        super().draw(context)
        state = sequence_object(context).refmesh
        if state.groups:
            self.layout.prop(state, "arrangement")
        measured = [frame for frame in state.frames if frame.is_property_set("distance")]
        if measured:
            draw_wrapped(self.layout, context, "Worst frames, mean distance in % of the diagonal:")
            self.layout.prop(state, "heat_map")
        column = self.layout.column(align=True)
        for frame in sorted(measured, key=lambda frame: -frame.distance)[:WORST_SHOWN]:
            column.operator("refmesh.go_to_frame", text=f"{frame.name}:  {100 * frame.distance:.3f} %").frame = frame.name


class REFMESH_PT_export(SequencePanel, bpy.types.Panel):
    bl_label = "Export"

    def draw(self, context):
        layout = self.layout
        state = sequence_object(context).refmesh
        first = first_to_run(state, "deformation")
        layout.label(text=f"Run {first} first" if first else f"Uses {len(state.groups)} deformed meshes", icon="IMPORT")
        layout.operator_menu_enum("refmesh.export", "format")
        layout.operator("refmesh.render_preview")


CLASSES = (
    REFMESH_PT_run,
    *SEQUENCE_CLASSES,
    REFMESH_PT_track,
    REFMESH_PT_centers,
    REFMESH_PT_reference,
    REFMESH_PT_bodies,
    REFMESH_PT_deform,
    REFMESH_PT_export,
)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
