"""The steps, each a job that runs up to its stage; results that are up to date are taken from the output folder."""

import bpy
from bpy.props import StringProperty

from .common import absolute, reporting
from .job import JobOperator
from .modal import POLL_INTERVAL
from .showing import ShowingOperator


class REFMESH_OT_run_all(JobOperator, bpy.types.Operator):
    """Run every step: track the volume, extract reference meshes, deform them to every frame, measure the distance, transfer colors"""

    bl_idname = "refmesh.run_all"
    bl_label = "Run All"
    until = "color"


class REFMESH_OT_track(JobOperator, bpy.types.Operator):
    """Fill the volume of every frame with points and track them through the sequence"""

    bl_idname = "refmesh.track"
    bl_label = "Track Volume"
    until = "tracking"


class REFMESH_OT_extract_reference(JobOperator, bpy.types.Operator):
    """Extract one reference mesh for each group of frames"""

    bl_idname = "refmesh.extract_reference"
    bl_label = "Extract Reference Meshes"
    until = "reference"


class REFMESH_OT_deform(JobOperator, bpy.types.Operator):
    """Deform the reference mesh of each group to the frames of the group"""

    bl_idname = "refmesh.deform"
    bl_label = "Deform"
    until = "deformation"


class REFMESH_OT_evaluate(JobOperator, bpy.types.Operator):
    """Measure the distance between source and deformed mesh in every frame"""

    bl_idname = "refmesh.evaluate"
    bl_label = "Measure Distance"
    until = "evaluation"


class REFMESH_OT_color(JobOperator, bpy.types.Operator):
    """Transfer the capture's colors to the reference meshes: a texture for each frame and a steady one for each mesh"""

    bl_idname = "refmesh.color"
    bl_label = "Transfer Colors"
    until = "color"


class REFMESH_OT_load_results(ShowingOperator, bpy.types.Operator):
    """Show results that are already in an output folder, from an earlier session or another machine"""

    bl_idname = "refmesh.load_results"
    bl_label = "Load Results"
    bl_options = {"UNDO"}

    output: StringProperty(
        name="Output", description="Folder with the results; empty takes that of the panel", subtype="DIR_PATH", options={"SKIP_SAVE"}
    )

    @reporting
    def execute(self, context):
        self.remember_sequence(self.take_sequence(context))
        if bpy.app.background:
            return self.show_all()
        self.start_modal(context, POLL_INTERVAL)
        self.start_showing(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        return self.show_next(context) if event.type == "TIMER" else {"PASS_THROUGH"}

    def cancel(self, context):
        self.end_modal(context)

    def results_folder(self):
        return absolute(self.output) if self.output else super().results_folder()


CLASSES = (
    REFMESH_OT_run_all,
    REFMESH_OT_track,
    REFMESH_OT_extract_reference,
    REFMESH_OT_deform,
    REFMESH_OT_evaluate,
    REFMESH_OT_color,
    REFMESH_OT_load_results,
)
