"""The steps that compute something, each with its settings, its button and its status."""

import bpy

from ..bridge.results.status import first_to_run, step_status
from ..core.settings import setting_names
from ..properties.selection import sequence_object
from .layout import SequencePanel, describe_seconds, draw_wrapped

WORST_SHOWN = 5  # frames listed with the largest distance
STATUS_ICONS = {"never": "BLANK1", "current": "CHECKMARK", "stale": "FILE_REFRESH"}


class StepPanel(SequencePanel):
    """A step: its input, its settings, its button, and whether its results are up to date with the settings."""

    stage = ""
    operators = ()

    def draw_header(self, context):
        self.layout.label(icon=STATUS_ICONS[step_status(sequence_object(context).refmesh, self.stage).kind])

    def draw_header_preset(self, context):
        seconds = step_status(sequence_object(context).refmesh, self.stage).seconds
        if seconds:
            self.layout.label(text=describe_seconds(seconds))
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
        draw_wrapped(layout, context, status.text[0].upper() + status.text[1:], icon=STATUS_ICONS[status.kind])

    @staticmethod
    def uses(state) -> str:
        """The input of the step."""
        raise NotImplementedError

    @classmethod
    def shown_settings(cls):
        """Names of the settings of this stage."""
        return setting_names(cls.stage)


class REFMESH_PT_track(StepPanel, bpy.types.Panel):
    bl_label = "Track"
    stage = "tracking"
    operators = ("refmesh.track",)

    @staticmethod
    def uses(state):
        return f"frames {state.frame_selection}" if state.frame_selection else f"all {len(state.frames)} frames"


class REFMESH_PT_reference(StepPanel, bpy.types.Panel):
    bl_label = "Reference"
    stage = "reference"
    operators = ("refmesh.extract_reference",)

    @classmethod
    def shown_settings(cls):
        return [name for name in super().shown_settings() if name != "apart"]  # it has a panel of its own

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
        return [*super().shown_settings(), *setting_names("evaluation")]

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


class REFMESH_PT_color(StepPanel, bpy.types.Panel):
    bl_label = "Color"
    stage = "color"
    operators = ("refmesh.color",)

    @staticmethod
    def uses(state):
        first = first_to_run(state, "evaluation")
        return f"the frames of Deform; {first} runs first" if first else f"{len(state.groups)} deformed meshes"

    def draw(self, context):
        super().draw(context)
        state = sequence_object(context).refmesh
        if "color" in state.done:
            self.layout.prop(state, "surface_color", expand=True)
