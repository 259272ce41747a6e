"""The steps that compute something, each with its settings, its button and its status."""

import bpy

from ..bridge.results.status import first_to_run, step_status
from ..core.counted import counted
from ..core.settings import OVER_REFERENCE
from ..properties.selection import sequence_object
from ..properties.wording import sentence
from .layout import SequencePanel, describe_seconds, draw_wrapped
from .step_settings import FIRST, draw_settings

WORST_SHOWN = 5  # frames listed with the largest distance or stretch
STRETCHED_SHOWN = 1e-3  # over-stretched share of the surface from which a frame is listed: below it are single triangles in creases
ROWS = 5  # of the list of places, before it scrolls
STATUS_ICONS = {"never": "BLANK1", "current": "CHECKMARK", "stale": "FILE_REFRESH"}


def _of_step(what: str, step: str, first: str) -> str:
    """What a step takes from one that is not up to date.  first : the step that a job begins with."""
    return f"the {what} of {step}, which runs first" if first == step else f"the {what} of {step}; {first} runs first"


class REFMESH_UL_places(bpy.types.UIList):
    """One line for each place at which a frame and its source are far apart; a click goes there."""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index):
        layout.label(text=f"{item.name}:  {100 * item.distance:.1f} %  {item.kind}", icon="REMOVE" if item.kind == "missing" else "ADD")


class StepPanel(SequencePanel):
    """A step: its input, its settings, its button, and whether its results are up to date with the settings."""

    stage = ""
    icon = ""
    operators = ()

    def draw_header(self, context):
        self.layout.label(icon=self.icon)

    def draw_header_preset(self, context):
        status = step_status(sequence_object(context).refmesh, self.stage)
        if status.seconds:
            self.layout.label(text=describe_seconds(status.seconds))
        self.layout.label(icon=STATUS_ICONS[status.kind])
        super().draw_header_preset(context)

    def draw(self, context):
        layout = self.layout
        layout.use_property_decorate = False
        state = sequence_object(context).refmesh
        draw_wrapped(layout, context, f"Uses {self.uses(state)}", icon="IMPORT")
        draw_settings(layout, state.settings, FIRST[self.stage])
        layout.use_property_split = True
        for operator in self.operators:
            layout.operator(operator)
        status = step_status(state, self.stage)
        draw_wrapped(layout, context, sentence(status.text), icon=STATUS_ICONS[status.kind])

    @staticmethod
    def uses(state) -> str:
        """The input of the step."""
        raise NotImplementedError


class REFMESH_PT_track(StepPanel, bpy.types.Panel):
    bl_label = "Track"
    stage = "tracking"
    icon = "OUTLINER_OB_POINTCLOUD"
    operators = ("refmesh.track",)

    @staticmethod
    def uses(state):
        return f"frames {state.frame_selection}" if state.frame_selection else f"all {counted(len(state.frames), 'frame')}"


class REFMESH_PT_reference(StepPanel, bpy.types.Panel):
    bl_label = "Reference"
    stage = "reference"
    icon = "MESH_ICOSPHERE"
    operators = ("refmesh.extract_reference",)

    @staticmethod
    def uses(state):
        first = first_to_run(state, "tracking")
        return "the centers of Track, which runs first" if first else f"{state.settings.centers} tracked centers"

    def draw(self, context):
        super().draw(context)
        settings, column = sequence_object(context).refmesh.settings, self.layout.column(align=True)
        if settings.mesh:
            over = "the reference mesh" if settings.mesh_frame == OVER_REFERENCE else f"frame {settings.mesh_frame}"
            column.label(text=f"Mesh of your own, over {over}", icon="MESH_DATA")
            column.operator("refmesh.forget_own_mesh")
        column.operator("refmesh.use_own_mesh", icon="MESH_DATA")
        column.operator("refmesh.remesh_to_quads", icon="MOD_REMESH")


class REFMESH_PT_deform(StepPanel, bpy.types.Panel):
    bl_label = "Deform"
    stage = "deformation"
    icon = "MOD_MESHDEFORM"
    operators = ("refmesh.deform", "refmesh.evaluate")

    @staticmethod
    def uses(state):
        first = first_to_run(state, "reference")
        return _of_step("meshes", "Reference", first) if first else counted(len(state.groups), "reference mesh", "reference meshes")

    def draw(self, context):
        super().draw(context)
        state = sequence_object(context).refmesh
        if state.groups:
            self.layout.prop(state, "arrangement")
        self._draw_bad(context, [frame for frame in state.frames if frame.bad])
        measured = [frame for frame in state.frames if frame.is_property_set("distance")]
        if measured:
            self.layout.prop(state, "heat_map")
            draw_wrapped(self.layout, context, "Worst frames: mean distance to the source in % of the diagonal")
            self._draw_worst(measured, "distance", 3)
        stretched = [frame for frame in state.frames if frame.overstretched > STRETCHED_SHOWN]
        if stretched:
            where = counted(len(stretched), "frame")
            draw_wrapped(self.layout, context, f"Stretched more than threefold, in {where}: % of the surface", icon="ERROR")
            self._draw_worst(stretched, "overstretched", 2)
        if state.places:
            draw_wrapped(self.layout, context, "Places that differ from the source by more than 1 % of the diagonal", icon="ERROR")
            self.layout.template_list("REFMESH_UL_places", "", state, "places", state, "active_place", rows=min(ROWS, len(state.places)))

    def _draw_bad(self, context, frames):
        """Buttons that go to the frames that are not fitted."""
        if frames:
            draw_wrapped(self.layout, context, f"Bad frames, which are not fitted: {len(frames)}", icon="ERROR")
            column = self.layout.column(align=True)
            for frame in frames[:WORST_SHOWN]:
                column.operator("refmesh.go_to_frame", text=f"{frame.name}:  {frame.bad}").frame = frame.name

    def _draw_worst(self, frames, name, digits):
        """Buttons that go to the frames with the largest values of a property."""
        column = self.layout.column(align=True)
        for frame in sorted(frames, key=lambda frame: -getattr(frame, name))[:WORST_SHOWN]:
            column.operator("refmesh.go_to_frame", text=f"{frame.name}:  {100 * getattr(frame, name):.{digits}f} %").frame = frame.name


class REFMESH_PT_color(StepPanel, bpy.types.Panel):
    bl_label = "Color"
    stage = "color"
    icon = "TEXTURE"
    operators = ("refmesh.color",)

    @staticmethod
    def uses(state):
        first = first_to_run(state, "evaluation")
        return _of_step("frames", "Deform", first) if first else counted(len(state.groups), "deformed mesh", "deformed meshes")

    def draw(self, context):
        super().draw(context)
        state = sequence_object(context).refmesh
        if "color" in state.done:
            row = self.layout.row(align=True)
            row.use_property_split = False  # the names need the whole width
            row.prop(state, "surface_color", expand=True)
