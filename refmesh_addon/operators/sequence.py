"""File > Import > Mesh Sequence (RefMesh)."""

import os
from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ..io.discovery import find_sequence
from ..io.formats import FRAME_FORMATS
from .common import SceneOperator, absolute, reporting
from .sequence_preview import AUTOMATIC_READING, describe, draw_preview, first_frame_kind, reading_items

AXES = {
    "Y": "The Y axis points up, as in most captures and glTF",
    "Z": "The Z axis points up, as in Blender",
    "X": "The X axis points up",
    "-Y": "The Y axis points down, as with depth cameras",
    "-Z": "The Z axis points down",
    "-X": "The X axis points down",
}
# Label, meaning, meters in one unit; 0 for those without meters.
UNITS = {
    "AS_IS": ("As It Is", "One unit of the files is one unit of the scene, whatever that is", 0.0),
    "M": ("Meters", "The files are in meters", 1.0),
    "CM": ("Centimeters", "The files are in centimeters", 0.01),
    "MM": ("Millimeters", "The files are in millimeters", 0.001),
    "IN": ("Inches", "The files are in inches", 0.0254),
    "FT": ("Feet", "The files are in feet", 0.3048),
    "FACTOR": ("Factor", "One unit of the files is the given number of units of the scene", 0.0),
}


class REFMESH_OT_import_sequence(SceneOperator, ImportHelper, bpy.types.Operator):
    """Import a sequence of meshes, one file for each frame: pick any of the files, and the others are imported too"""

    bl_idname = "refmesh.import_sequence"
    bl_label = "Import Sequence"  # short enough for the button of the file browser
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(
        name="File",
        description="Any file of the sequence, its folder, or a pattern such as scan_*.obj or scan_#_lod0.obj",
        subtype="FILE_PATH",
    )
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    filter_glob: StringProperty(default=";".join(f"*{extension}" for extension in FRAME_FORMATS), options={"HIDDEN"})
    frames: StringProperty(
        name="Frames", description="Numbers as in the file names, such as 6-10,14; empty takes all", options={"SKIP_SAVE"}
    )
    reading: EnumProperty(
        name="Frame Number",
        description="Which number in the names counts the frames, where there are several",
        items=lambda self, context: reading_items(str(_picked(self)), self.frames),
        options={"HIDDEN", "SKIP_SAVE"},
    )
    name: StringProperty(name="Name", description="Name of the sequence in the scene; empty takes it from the files", options={"SKIP_SAVE"})
    up_axis: EnumProperty(
        name="Up Axis",
        description="Axis of the files that points up; data and results stay in the coordinates of the files",
        items=[(axis, f"{axis} Up", meaning) for axis, meaning in AXES.items()],
    )
    unit: EnumProperty(
        name="Unit",
        description="Unit of length in the files; data and results stay in the coordinates of the files",
        items=[(unit, label, meaning) for unit, (label, meaning, _) in UNITS.items()],
    )
    unit_factor: FloatProperty(
        name="Factor", description="Units of the scene in one unit of the files, where the unit is Factor", default=1.0, min=1e-9
    )
    set_timeline: BoolProperty(
        name="Set Timeline",
        description="Set the frame range of the scene to that of the sequence; the Sequence panel can do it later too",
        default=True,
    )
    fps: FloatProperty(
        name="Frame Rate", description="Frames per second for the scene; 0 keeps that of the scene", default=0.0, min=0.0, max=1000.0
    )
    check: BoolProperty(
        name="Check Sequence",
        description="Check every frame for defects in the background, and prepare it for smooth playback",
        default=True,
        options={"HIDDEN"},
    )
    empty_scene: BoolProperty(
        name="Empty Scene", description="Remove everything from the scene first; meant for scripts", options={"HIDDEN", "SKIP_SAVE"}
    )

    def invoke(self, context, event):
        self.set_timeline = not bpy.data.actions  # the default; a scene that is already animated keeps its timeline
        self.fps = context.scene.render.fps / context.scene.render.fps_base
        self.interactive = True
        return super().invoke(context, event)

    @reporting
    def execute(self, context):
        from ..bridge.scene import timeline as scene
        from ..bridge.scene.focus import focus, hide_startup_cube, longest_side
        from ..bridge.scene.paths import stored_path
        from ..bridge.sequence import raw_sequence
        from ..core.capture.scale import scale_note

        sequence = find_sequence(self._source(), self.frames)
        output = sequence.folder / f"refmesh_{sequence.name}"
        first = raw_sequence.read_frame(sequence.frames[0].path, output)  # before the scene is touched: it may fail
        if self.empty_scene:
            scene.empty_scene()
        unit = self._scale(context.scene)
        owner = raw_sequence.new_sequence(context.scene, sequence, first, self.name or sequence.name, self.up_axis, unit)
        scene.widen_clipping(unit * max(np.ptp(first.vertices, axis=0)))
        state = owner.refmesh
        state.source, state.frame_selection, state.output = stored_path(self._source()), self.frames, stored_path(output)
        if self.set_timeline:
            scene.set_timeline(context.scene, state.frames[0].scene_frame, state.frames[-1].scene_frame, self.fps)
        hidden = "; the cube of the startup scene is hidden" if hide_startup_cube(context.scene) else ""
        focus(owner)
        note = scale_note(longest_side(owner, context.scene))
        kind = "" if self.empty_scene else first_frame_kind(sequence.frames[0].path)  # of a script, the job says it
        self.report({"INFO"}, "; ".join(filter(None, (describe(sequence) + hidden, kind, note))))
        if self.check and getattr(self, "interactive", False):
            bpy.ops.refmesh.check_sequence("INVOKE_DEFAULT")
        return {"FINISHED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        draw_preview(layout.box(), str(self._source()), self.frames, self._scale(context.scene) * context.scene.unit_settings.scale_length)
        if len(reading_items(str(_picked(self)), self.frames)) > 1:
            layout.prop(self, "reading")
        factor = ("unit_factor",) if self.unit == "FACTOR" else ()
        for name in ("frames", "name", "up_axis", "unit", *factor, "set_timeline", "fps", "check"):
            layout.prop(self, name)

    def _source(self) -> Path:
        """The path to import, or the pattern by which its names are to be read."""
        return _picked(self) if self.reading in ("", AUTOMATIC_READING[0]) else Path(self.reading)

    def _scale(self, scene) -> float:
        """Units of the scene in one unit of the files."""
        meters = UNITS[self.unit][-1]
        if meters:
            return meters / scene.unit_settings.scale_length
        return self.unit_factor if self.unit == "FACTOR" else 1.0


def _picked(properties) -> Path:
    """The path to import: a file of `directory` that was picked in the file browser; `filepath` alone from a script."""
    if properties.directory and properties.files and properties.files[0].name:
        return absolute(os.path.join(properties.directory, properties.files[0].name))
    return absolute(properties.filepath or properties.directory)


CLASSES = (REFMESH_OT_import_sequence,)
