"""Exports the deformed meshes to other programs."""

import os
import sys

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ..bridge.formats import registry
from ..bridge.formats.choice import choose, chosen_range
from ..bridge.formats.export import Export
from ..bridge.results.status import export_note
from ..bridge.scene.paths import absolute_path
from ..core.counted import counted
from ..core.errors import RefMeshError
from ..pipeline.session.exported_files import EXPORT_FOLDER, ExportedFiles
from ..properties.selection import sequence_object
from ..properties.wording import draw_wrapped
from .common import SequenceOperator, absolute, reporting, wait_cursor
from .format_options import argument_names, chosen_options, format_arguments

DIALOG_WIDTH = 360  # pixels at a resolution scale of 1
SCOPES = [
    ("SEQUENCE", "Sequence", "All groups of the sequence"),
    ("OBJECT", "Active Object", "The group whose deformed or reference mesh is the active object"),
    ("COLLECTION", "Active Collection", "Every sequence in the active collection, each in files of its own"),
]


QUALITY_ARGUMENTS = [argument_names(known)["quality"] for known in registry.written_formats() if known.estimate is not None]
ESTIMATED_AS = {"glb": "glTF Binary, small"}  # of the two kinds of this format


class FormatArguments:
    """The options of all formats as arguments. A class of their own: from Python 3.14 on, a class body cannot add to its annotations."""

    __annotations__ = format_arguments(registry.written_formats())


class REFMESH_OT_export(FormatArguments, SequenceOperator, bpy.types.Operator):
    """Write the deformed meshes for other programs"""

    bl_idname = "refmesh.export"
    bl_label = "Export"
    changes_sequence = False

    format: EnumProperty(
        name="Format",
        description="File format",
        items=[(known.name, known.label, known.contents) for known in registry.written_formats()],
    )
    directory: StringProperty(
        name="Folder", description="Where to write; empty takes 'export' in the output folder", subtype="DIR_PATH", options={"SKIP_SAVE"}
    )
    scope: EnumProperty(name="Scope", description="What is exported", items=SCOPES, default="SEQUENCE", options={"SKIP_SAVE"})
    first: IntProperty(
        name="First Frame", description="Scene frame to begin with; 0 takes the first of the sequence", min=0, options={"SKIP_SAVE"}
    )
    last: IntProperty(
        name="Last Frame", description="Scene frame to end with; 0 takes the last of the sequence", min=0, options={"SKIP_SAVE"}
    )
    step: IntProperty(
        name="Frame Step",
        description="Export every Nth frame; Alembic and USD hold every frame",
        default=1,
        min=1,
        options={"SKIP_SAVE"},
    )
    apply_modifiers: BoolProperty(
        name="Apply Modifiers",
        description="Export what modifiers above the cache make of the deformed meshes; Alembic, USD and full glTF",
        default=True,
        options={"SKIP_SAVE"},
    )
    only_check: BoolProperty(
        name="Only Check",
        description="Only check that this Blender can write the format, and this choice of frames in it",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    quiet: BoolProperty(
        name="Quiet", description="Do not print size and error of the files to stderr in background mode", options={"HIDDEN", "SKIP_SAVE"}
    )

    def invoke(self, context, event):
        state = sequence_object(context).refmesh
        self.first, self.last = state.frames[0].scene_frame, state.frames[-1].scene_frame
        for name in QUALITY_ARGUMENTS:
            setattr(self, name, state.export_quality)
        return context.window_manager.invoke_props_dialog(self, width=DIALOG_WIDTH)

    @reporting
    def execute(self, context):
        registry.check_writable(registry.FORMATS[self.format], self.step)
        if self.only_check:
            for owner in self._owners(context):
                chosen_range(owner, self.first, self.last, self.step)
            return {"FINISHED"}
        member = context.active_object if self.scope == "OBJECT" else None
        choices = {owner: choose(owner, self.first, self.last, self.step, member) for owner in self._owners(context)}
        files = {owner: ExportedFiles(absolute_path(owner, owner.refmesh.output)) for owner in choices}
        exports = [self._export_of(owner, choice, files[owner]) for owner, choice in choices.items()]
        try:
            with wait_cursor(context):
                written = [path for export in exports for path in registry.write(registry.FORMATS[self.format], export)]
        finally:
            self._tell_kept(path for each in files.values() for path in each.kept)
        self.report({"INFO"}, f"wrote {counted(len(written), 'file')} to {os.path.dirname(written[0])}")
        for export in exports:
            self._tell(export)
        for owner in choices:
            note = export_note(owner.refmesh)
            if note:
                self.report({"WARNING"}, f"{owner.refmesh.root.name}: {note[0].lower()}{note[1:]}")
        return {"FINISHED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        note = export_note(sequence_object(context).refmesh)
        if note:
            draw_wrapped(layout, note, DIALOG_WIDTH * context.preferences.system.ui_scale, icon="ERROR")
        formats = layout.grid_flow(columns=3, even_columns=True, align=True)
        for known in registry.written_formats():
            cell = formats.row(align=True)
            cell.enabled = not known.unavailable()
            cell.prop_enum(self, "format", known.name)
        options = argument_names(registry.FORMATS[self.format]).values()
        for name in (*options, "scope", "first", "last", "step", "apply_modifiers", "directory"):
            layout.prop(self, name)

    def _export_of(self, owner, choice, files):
        results = absolute_path(owner, owner.refmesh.output)
        folder = absolute(self.directory) if self.directory else results / EXPORT_FOLDER
        options = chosen_options(self.properties, registry.FORMATS[self.format])
        return Export(owner, choice, results, folder, options, self.apply_modifiers, unwrapped_mesh, make_way=files.make_way)

    def _tell(self, export):
        """Size and error of what was written: in the window, on stderr, and in the panel."""
        for note in export.notes:
            text = f"{registry.FORMATS[self.format].label}: {note}"
            self.report({"INFO"}, text)
            if bpy.app.background and not self.quiet:
                print(text, file=sys.stderr)
            if export.owner.library is None:
                export.owner.refmesh.exported = text

    def _tell_kept(self, kept):
        for path in kept:
            self.report({"WARNING"}, f"{path.parent}: something that no export of these results had written is kept as {path.name}")

    def _owners(self, context):
        if self.scope != "COLLECTION":
            return [sequence_object(context)]
        owners = [member for member in context.collection.all_objects if member.refmesh.frames]
        if not owners:
            raise RefMeshError(f"the collection '{context.collection.name}' holds no mesh sequence; click another one in the outliner")
        return owners


class REFMESH_OT_estimate_export(SequenceOperator, bpy.types.Operator):
    """Estimate size and error of small files at this quality, in some seconds"""

    bl_idname = "refmesh.estimate_export"
    bl_label = "Estimate Size"
    changes_sequence = False

    @reporting
    def execute(self, context):
        owner = sequence_object(context)
        choice, results = choose(owner, 0, 0, 1), absolute_path(owner, owner.refmesh.output)
        quality, lines = owner.refmesh.export_quality, []
        for known in registry.written_formats():
            if known.estimate is not None and not known.unavailable():
                export = Export(owner, choice, results, results / EXPORT_FOLDER, known.options(quality=quality), unwrap=unwrapped_mesh)
                with wait_cursor(context):
                    lines.append(f"{ESTIMATED_AS.get(known.name, known.label)}: {known.estimate(export)}")
        owner.refmesh.export_estimates = "\n".join(lines)
        for line in lines:
            self.report({"INFO"}, line)
        return {"FINISHED"}


def unwrapped_mesh(mesh):
    """A texture layout of a mesh; None where xatlas is missing, fails or takes too long."""
    from ..pipeline.session.unwrapping import unwrapped  # late: SciPy comes with it, and may be missing

    return unwrapped(mesh)


CLASSES = (REFMESH_OT_export, REFMESH_OT_estimate_export)
