"""Deformed meshes out to other programs."""

import os

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..bridge.exports import FORMATS, check_available, export_sequence
from ..properties import sequence_object
from .common import SequenceOperator, absolute, reporting


class REFMESH_OT_export(SequenceOperator, bpy.types.Operator):
    """Write the deformed meshes for other programs"""

    bl_idname = "refmesh.export"
    bl_label = "Export"

    format: EnumProperty(
        name="Format", description="File format", items=[(key, key.upper(), words) for key, words in FORMATS.items()], default="pc2"
    )
    directory: StringProperty(
        name="Folder", description="Where to write; empty takes 'export' in the output folder", subtype="DIR_PATH", options={"SKIP_SAVE"}
    )

    only_check: BoolProperty(
        name="Only Check", description="Only say whether this Blender can write the format", options={"HIDDEN", "SKIP_SAVE"}
    )

    @reporting
    def execute(self, context):
        check_available(self.format)
        if self.only_check:
            return {"FINISHED"}
        owner = sequence_object(context)
        results = absolute(owner.refmesh.output)
        folder = absolute(self.directory) if self.directory else results / "export"
        written = export_sequence(owner, self.format, results, folder)
        self.report({"INFO"}, f"wrote {len(written)} files to {os.path.dirname(written[0])}")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_export,)
