"""File > Import > Mesh Sequence (RefMesh)."""

import os
from functools import lru_cache
from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ..core.errors import RefMeshError
from ..io.discovery import find_sequence
from ..io.formats import FRAME_FORMATS
from ..io.frame_range import in_words
from ..io.sequence import Sequence
from .common import SceneOperator, absolute, reporting

AXES = {
    "Y": "As most captures and glTF have it",
    "Z": "As Blender has it",
    "X": "The X axis points up",
    "-Y": "Y points down, as depth cameras have it",
    "-Z": "Z points down",
    "-X": "The X axis points down",
}
# Name, what it means, meters in one unit.
UNITS = {
    "M": ("Meters", "One unit of the files is one unit of the scene", 1.0),
    "CM": ("Centimeters", "The files count in centimeters", 0.01),
    "MM": ("Millimeters", "The files count in millimeters", 0.001),
    "IN": ("Inches", "The files count in inches", 0.0254),
    "FT": ("Feet", "The files count in feet", 0.3048),
}
MOST_AT_ONCE = 20_000_000  # bytes of a file that is read while the file browser is drawn


class REFMESH_OT_import_sequence(SceneOperator, ImportHelper, bpy.types.Operator):
    """Import a sequence of meshes, one file for each frame: pick any of them, the rest is found"""

    bl_idname = "refmesh.import_sequence"
    bl_label = "Mesh Sequence (RefMesh)"
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(
        name="File", description="Any file of the sequence, its folder, or a pattern such as scan_*.obj", subtype="FILE_PATH"
    )
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    filter_glob: StringProperty(default=";".join(f"*{extension}" for extension in FRAME_FORMATS), options={"HIDDEN"})
    frames: StringProperty(
        name="Frames", description="Numbers as in the file names, such as 6-10,14; empty takes all", options={"SKIP_SAVE"}
    )
    name: StringProperty(name="Name", description="Name of the sequence in the scene; empty takes it from the files", options={"SKIP_SAVE"})
    up_axis: EnumProperty(
        name="Up Axis",
        description="Axis of the files that points up; data and results stay in the coordinates of the files",
        items=[(axis, f"{axis} Up", words) for axis, words in AXES.items()],
    )
    unit: EnumProperty(
        name="Unit",
        description="Length that the files count in; data and results stay in the coordinates of the files",
        items=[(unit, label, words) for unit, (label, words, _) in UNITS.items()],
    )
    set_timeline: BoolProperty(
        name="Set Timeline",
        description="Set the frame range of the scene to that of the sequence; the Sequence panel can do it later too",
        default=True,
    )
    fps: FloatProperty(
        name="Frame Rate", description="Frames per second for the scene; 0 leaves the scene's own", default=0.0, min=0.0, max=1000.0
    )
    check: BoolProperty(
        name="Check Sequence",
        description="Look at every frame in the background: find what is wrong with it, and prepare it for smooth playback",
        default=True,
        options={"HIDDEN"},
    )
    empty_scene: BoolProperty(
        name="Empty Scene", description="Remove everything from the file first; meant for scripts", options={"HIDDEN", "SKIP_SAVE"}
    )

    def invoke(self, context, event):
        self.set_timeline = not bpy.data.actions  # offered; a scene that is animated already keeps its timeline
        self.interactive = True
        return super().invoke(context, event)

    @reporting
    def execute(self, context):
        from ..bridge.scene import timeline as scene
        from ..bridge.sequence import raw_sequence as sequence

        found = find_sequence(self._source(), self.frames)
        output = found.frames[0].path.parent / f"refmesh_{found.name}"
        first = sequence.read_frame(found.frames[0].path, output)  # before the scene is touched: it may fail
        if self.empty_scene:
            scene.empty_scene()
        unit = UNITS[self.unit][-1]
        owner = sequence.new_sequence(context.scene, found, first, self.name or found.name, self.up_axis, unit)
        scene.reach_with_views(unit * max(np.ptp(first.vertices, axis=0)))
        state = owner.refmesh
        state.source, state.frame_selection, state.output = str(self._source()), self.frames, str(output)
        if self.set_timeline:
            scene.set_timeline(context.scene, state.frames[0].scene_frame, state.frames[-1].scene_frame, self.fps)
        context.view_layer.objects.active = owner
        self.report({"INFO"}, describe(found))
        if self.check and getattr(self, "interactive", False):
            bpy.ops.refmesh.check_sequence("INVOKE_DEFAULT")
        return {"FINISHED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        box = layout.box()
        lines = preview(str(self._source()), self.frames)
        sides = sides_of_first(str(self._source()), self.frames) if len(lines) == len(PREVIEW_ICONS) else ()
        for line, icon in zip(lines, PREVIEW_ICONS):
            box.label(text=line, icon=icon)
        if sides:
            box.label(text=in_meters(sides, UNITS[self.unit][-1]), icon="CON_SIZELIMIT")
        for name in ("frames", "name", "up_axis", "unit", "set_timeline", "fps", "check"):
            layout.prop(self, name)

    def _source(self) -> Path:
        """What was picked: in the file browser a file of `directory`, from a script `filepath` alone."""
        if self.directory and self.files and self.files[0].name:
            return absolute(os.path.join(self.directory, self.files[0].name))
        return absolute(self.filepath or self.directory)


def describe(found: Sequence) -> str:
    """One line about a sequence: name, count, range, gaps."""
    gaps = f", missing {in_words(found.gaps)}" if found.gaps else ""
    return f"{found.name}: {len(found.frames)} frames, {in_words(found.numbers)}{gaps}"


PREVIEW_ICONS = ("SEQUENCE", "PREVIEW_RANGE", "BLANK1", "FILE_BLANK")


@lru_cache(maxsize=8)
def preview(source: str, frames: str) -> tuple[str, ...]:
    """What would be imported, for the file browser, which draws often: name, frames, gaps, size."""
    try:
        found = find_sequence(source, frames)
        size = sum(frame.path.stat().st_size for frame in found.frames)
    except (RefMeshError, OSError) as error:
        return (str(error),)
    gaps = f"missing: {in_words(found.gaps)}" if found.gaps else "no gaps"
    return (found.name, f"{len(found.frames)} frames: {in_words(found.numbers)}", gaps, in_bytes(size))


@lru_cache(maxsize=8)
def sides_of_first(source: str, frames: str) -> tuple[float, ...]:
    """Sides of the bounding box of the first frame, in the units of the file; () where it cannot be read at once."""
    try:
        path = find_sequence(source, frames).frames[0].path
        if path.stat().st_size > MOST_AT_ONCE:
            return ()
        from ..io.meshes import read_mesh

        return tuple(map(float, np.ptp(read_mesh(path).vertices, axis=0)))
    except (RefMeshError, OSError):
        return ()


def in_meters(sides: tuple[float, ...], unit: float) -> str:
    """(170, 60, 25) in centimeters as "1.7 x 0.6 x 0.25 m": whether the unit is the right one."""
    return " x ".join(f"{unit * side:.3g}" for side in sides) + " m"


def in_bytes(size: int) -> str:
    """1234567 as "1.2 MB"."""
    return f"{size / 1e9:.2f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"


CLASSES = (REFMESH_OT_import_sequence,)
