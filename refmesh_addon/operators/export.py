"""Deformed meshes out to other programs."""

import os

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ..bridge.exports.choice import choose
from ..bridge.exports.export import FORMATS, check_available, export_sequence
from ..core.errors import RefMeshError
from ..properties import sequence_object
from .common import SequenceOperator, absolute, reporting

SCOPES = [
    ("SEQUENCE", "Sequence", "All groups of the sequence"),
    ("OBJECT", "Active Object", "The group whose deformed or reference mesh is the active object"),
    ("COLLECTION", "Active Collection", "Every sequence in the active collection, each in files of its own"),
]


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
    scope: EnumProperty(name="What", description="What is exported", items=SCOPES, default="SEQUENCE", options={"SKIP_SAVE"})
    first: IntProperty(
        name="First Frame", description="Scene frame to begin with; 0 takes the first of the sequence", min=0, options={"SKIP_SAVE"}
    )
    last: IntProperty(
        name="Last Frame", description="Scene frame to end with; 0 takes the last of the sequence", min=0, options={"SKIP_SAVE"}
    )
    step: IntProperty(
        name="Frame Step",
        description="Export every so many frames; Alembic and USD hold every frame",
        default=1,
        min=1,
        options={"SKIP_SAVE"},
    )
    only_check: BoolProperty(
        name="Only Check", description="Only say whether this Blender can write the format", options={"HIDDEN", "SKIP_SAVE"}
    )

    def invoke(self, context, event):
        frames = sequence_object(context).refmesh.frames
        self.first, self.last = frames[0].scene_frame, frames[-1].scene_frame
        return context.window_manager.invoke_props_dialog(self, width=360)

    @reporting
    def execute(self, context):
        check_available(self.format)
        if self.only_check:
            return {"FINISHED"}
        member = context.active_object if self.scope == "OBJECT" else None
        choices = {owner: choose(owner, self.first, self.last, self.step, member) for owner in self._owners(context)}
        written = [path for owner, choice in choices.items() for path in self._export(owner, choice)]
        self.report({"INFO"}, f"wrote {len(written)} files to {os.path.dirname(written[0])}")
        return {"FINISHED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        for name in ("format", "scope", "first", "last", "step", "directory"):
            layout.prop(self, name)

    def _export(self, owner, choice):
        results = absolute(owner.refmesh.output)
        folder = absolute(self.directory) if self.directory else results / "export"
        return export_sequence(owner, self.format, choice, results, folder)

    def _owners(self, context):
        if self.scope != "COLLECTION":
            return [sequence_object(context)]
        found = [member for member in context.collection.all_objects if member.refmesh.frames]
        if not found:
            raise RefMeshError(f"the collection '{context.collection.name}' holds no mesh sequence; click another one in the outliner")
        return found


CLASSES = (REFMESH_OT_export,)
