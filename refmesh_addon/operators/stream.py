"""Compressed streams of RefMesh as input."""

from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty

from ..bridge.scene.objects import ROOT_ROTATION
from ..core.counted import counted
from ..pipeline.process.remote_stream import RemoteStream, decoded_files
from .common import SceneOperator, absolute, reporting, wait_cursor

FOLDER = "Where to write; empty takes a folder of the same name beside the file"


class REFMESH_OT_decode_stream(SceneOperator, bpy.types.Operator):
    """Write the frames of a compressed .refmesh file as PLY files, which Import Mesh Sequence and other programs read"""

    bl_idname = "refmesh.decode_stream"
    bl_label = "Decode RefMesh Stream"

    filepath: StringProperty(name="File", description="A .refmesh file", subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: StringProperty(default="*.refmesh", options={"HIDDEN"})
    output: StringProperty(name="Folder", description=FOLDER, subtype="DIR_PATH", options={"SKIP_SAVE"})

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @reporting
    def execute(self, context):
        with wait_cursor(context):
            written = decoded_files(absolute(self.filepath), folder_of(self))
        self.report({"INFO"}, f"wrote {counted(len(written), 'file')} to {written[0].parent}")
        return {"FINISHED"}


class REFMESH_OT_import_stream(SceneOperator, bpy.types.Operator):
    """Import a compressed .refmesh file as objects that play, one for each group of frames"""

    bl_idname = "refmesh.import_stream"
    bl_label = "Import RefMesh Stream"
    bl_options = {"UNDO"}

    filepath: StringProperty(name="File", description="A .refmesh file", subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: StringProperty(default="*.refmesh", options={"HIDDEN"})
    output: StringProperty(name="Folder", description=FOLDER, subtype="DIR_PATH", options={"SKIP_SAVE"})
    up_axis: EnumProperty(
        name="Up Axis", description="Which axis of the file points up", items=[(axis, axis, "") for axis in ROOT_ROTATION], default="Y"
    )

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @reporting
    def execute(self, context):
        from ..bridge.results.stream import import_stream

        with wait_cursor(context):
            root = import_stream(context.scene, RemoteStream(absolute(self.filepath)), folder_of(self), self.up_axis)
        context.view_layer.objects.active = root
        return {"FINISHED"}


def folder_of(operator) -> Path:
    """Where an operator writes."""
    return absolute(operator.output) if operator.output else absolute(operator.filepath).with_suffix("")


CLASSES = (REFMESH_OT_decode_stream, REFMESH_OT_import_stream)
