"""Writes a job for a render farm instead of running it."""

import json
from dataclasses import replace

import bpy
from bpy.props import EnumProperty, StringProperty

from ..core.errors import RefMeshError
from .common import absolute, reporting, sequence_object
from .job import JobOperator

FORMATS = (("openjd", "Open Job Description", "A template with the units of work as tasks, for AWS Deadline Cloud and other render farms"),)


class REFMESH_OT_export_job(JobOperator, bpy.types.Operator):
    """Write the job, with its steps and tasks, for a render farm instead of running it here"""

    bl_idname = "refmesh.export_job"
    bl_label = "Export Job"
    until = "color"
    __annotations__ = {
        "format": EnumProperty(name="Format", description="What the render farm reads", items=FORMATS, options={"SKIP_SAVE"}),
        "directory": StringProperty(name="Folder", description="Where to write the job", subtype="DIR_PATH", options={"SKIP_SAVE"}),
        "scene_command": StringProperty(
            name="Scene Command",
            description="Start and options, as JSON, of a command that writes the scene and exports in a last step; for scripts",
            options={"HIDDEN", "SKIP_SAVE"},
        ),
        **JobOperator.__annotations__,
    }

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @reporting
    def execute(self, context):
        from ..io.discovery import find_sequence
        from ..pipeline.process.open_job import SceneCommand, write_open_job

        spec = replace(self._spec(sequence_object(context).refmesh), scheduler="")  # the render farm shares the work itself
        if not self.directory:
            raise RefMeshError("no folder to write the job to; choose one")
        sequence = find_sequence(spec.source, spec.frames)
        scene = SceneCommand(*json.loads(self.scene_command)) if self.scene_command else None
        files = write_open_job(absolute(self.directory), spec, sequence.name, len(sequence.frames), scene)
        self.report({"INFO"}, f"wrote {files[0]}")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_export_job,)
