"""What a sequence in the scene remembers, and the settings of the core as Blender properties.

No `from __future__ import annotations` here: Blender reads the annotations as values.
"""

from dataclasses import fields

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from .core.errors import RefMeshError
from .core.findings import CENTER_ATTRIBUTES
from .core.settings import EDITS, PRESETS, Settings, flat_fields

STAGES = tuple(stage.name for stage in fields(Settings))  # the steps a sequence goes through, in order
# Says that a path may begin with "//"; unknown before Blender 4.5.
RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5) else set()
UNKNOWN = -1.0  # a distance that has not been measured


def title(name: str) -> str:
    """ "group_size" as the panel writes it: "Group Size"."""
    return name.replace("_", " ").title()


def blender_property(setting, **options):
    """The bpy property that shows one dataclass field of `core.settings`, with its range, choices and help."""
    meta, default = setting.metadata, setting.default
    shared = {"name": meta["label"] or title(setting.name), "description": meta["help"], "default": default, **options}
    if meta["choices"] is not None:
        return EnumProperty(items=[(key, title(key), words) for key, words in meta["choices"].items()], **shared)
    if isinstance(default, bool):
        return BoolProperty(**shared)
    if isinstance(default, str):
        return StringProperty(**shared)
    kind = IntProperty if isinstance(default, int) else FloatProperty
    limits = {key: meta[bound] for key, bound in (("min", "low"), ("max", "high")) if meta[bound] is not None}
    return kind(**shared, **limits)


def setting_properties(**options) -> dict:
    """name -> bpy property for every setting of every stage, for the annotations of a panel's or operator's class."""
    return {setting.name: blender_property(setting, **options) for setting in flat_fields()}


def plain_value(holder, name: str) -> object:
    """A property's value; a float as it was typed, since Blender holds 0.01 as 0.0099999998."""
    value = getattr(holder, name)
    return float(f"{value:.6g}") if isinstance(value, float) else value


class RefMeshSettings(bpy.types.PropertyGroup):
    """All settings of the pipeline, made from the dataclasses of `core.settings`."""

    __annotations__ = setting_properties()

    def to_flat(self) -> dict[str, object]:
        """name -> value, as `Settings.from_flat` takes it."""
        return {setting.name: plain_value(self, setting.name) for setting in flat_fields()}

    def assign(self, values: dict[str, object]) -> None:
        """Sets each named value."""
        for name, value in values.items():
            setattr(self, name, value)

    def matching_preset(self) -> str:
        """The preset that these settings are, or ""."""
        current = Settings.from_flat({name: value for name, value in self.to_flat().items() if name not in EDITS})
        return next((name for name, values in PRESETS.items() if Settings.from_flat(values) == current), "")


class RefMeshFrame(bpy.types.PropertyGroup):
    """One frame of a sequence; `name` holds its number, which may be a time stamp too long for a Blender integer."""

    path: StringProperty(name="File", description="The mesh of this frame", subtype="FILE_PATH", options=RELATIVE)
    scene_frame: IntProperty(name="Scene Frame", description="Frame of the timeline from which this mesh is shown")
    distance: FloatProperty(name="Distance", description="Mean distance to the deformed mesh, share of the diagonal", default=UNKNOWN)


class RefMeshFinding(bpy.types.PropertyGroup):
    """What the check of the sequence found; `name` holds the number of the frame."""

    severity: StringProperty(name="Severity", description="How grave it is: error, warning or note")
    words: StringProperty(name="Finding", description="What was found")


def go_to_finding(state, context):
    """The timeline goes to the frame of the finding that was clicked."""
    frame = state.frames.get(state.findings[state.active_finding].name)
    if frame is not None:
        context.scene.frame_set(frame.scene_frame)


class RefMeshGroup(bpy.types.PropertyGroup):
    """The two objects of one group of frames."""

    start: IntProperty(name="Start", description="Scene frame from which this group is shown")
    reference: PointerProperty(type=bpy.types.Object, name="Reference Mesh", description="Reference mesh of this group")
    deformed: PointerProperty(type=bpy.types.Object, name="Deformed Mesh", description="Reference mesh as it moves through this group")


def arrange_objects(state, context):
    """Side by side or in one place, at once."""
    from .bridge.results.groups import arrange

    arrange(state.id_data)


def restyle(state, context):
    """The centers as they are wanted, at once."""
    from .bridge.results.centers import restyle_centers

    restyle_centers(state.id_data)


def switch_errors(state, context):
    """Errors in color, or the plain color, at once."""
    from .bridge.results.heat_map import switch_heat_map

    try:
        switch_heat_map(state.id_data)
    except RefMeshError as error:
        words = str(error)
        state.heat_map = False
        if not bpy.app.background:
            context.window_manager.popup_menu(lambda menu, _: menu.layout.label(text=words), title="RefMesh", icon="ERROR")


class RefMeshSequence(bpy.types.PropertyGroup):
    """State of one sequence, kept on its mesh object; its other objects carry only the pointer `sequence` to that one."""

    sequence: PointerProperty(type=bpy.types.Object, name="Sequence", description="The mesh-sequence object this object belongs to")
    source: StringProperty(
        name="Source", description="Folder, file or pattern that the frames come from", subtype="FILE_PATH", options=RELATIVE
    )
    frame_selection: StringProperty(name="Frames", description="Numbers as in the file names, such as 6-10,14; empty takes all")
    output: StringProperty(
        name="Output",
        description="Folder that results are written to and read from; // is beside the saved scene",
        subtype="DIR_PATH",
        options=RELATIVE,
    )
    frames: CollectionProperty(type=RefMeshFrame)
    findings: CollectionProperty(type=RefMeshFinding)
    active_finding: IntProperty(name="Finding", description="Click a finding to go to its frame", update=go_to_finding)
    checked: BoolProperty(name="Checked", description="Whether every frame was looked at", options={"HIDDEN"})
    shown: StringProperty(name="Shown Frame", description="Number of the frame whose mesh is in the object now", options={"HIDDEN"})
    root: PointerProperty(type=bpy.types.Object, name="Root", description="Empty that everything of this sequence hangs on")
    centers: PointerProperty(type=bpy.types.Object, name="Centers", description="Points that follow the volume")
    center_color: EnumProperty(
        name="Colored by",
        description="What the colors of the centers say",
        items=[
            ("PLACE", "Place", "Where a center is in the first frame, so that one can see what went where"),
            *((name.upper(), title(name), words) for name, words in CENTER_ATTRIBUTES.items()),
        ],
        update=restyle,
    )
    center_size: FloatProperty(
        name="Size", description="Of the centers; at 4 neighbors touch", default=1.0, min=0.01, soft_max=4.0, update=restyle
    )
    center_spacing: FloatProperty(name="Spacing", description="Usual distance of neighboring centers", options={"HIDDEN"})
    center_range: StringProperty(name="Range", description="What the colors of the centers mean", options={"HIDDEN"})
    trails: PointerProperty(type=bpy.types.Object, name="Trails", description="Where chosen centers go")
    groups: CollectionProperty(type=RefMeshGroup)
    arrangement: EnumProperty(
        name="Arrangement",
        description="Where centers, reference mesh and result stand beside the source",
        items=[
            ("SIDE", "Side by Side", "Source, centers, reference mesh and result in a row"),
            ("OVERLAY", "Overlaid", "All in one place, to see where they differ"),
        ],
        update=arrange_objects,
    )
    heat_map: BoolProperty(
        name="Show Errors",
        description="Color the deformed mesh by its distance to the source: dark for none, yellow for 0.2 % of the diagonal and more",
        update=switch_errors,
    )
    heat_shown: StringProperty(name="Frame of the Errors", description="Whose errors the mesh carries now", options={"HIDDEN"})
    side_step: FloatProperty(name="Distance", description="Between source, reference mesh and result", options={"HIDDEN"})
    settings: PointerProperty(type=RefMeshSettings)
    missing: StringProperty(name="Missing", description="What the scene needs and was not there when it was opened", options={"HIDDEN"})
    results: StringProperty(
        name="Results", description="What the results were made with, as JSON: settings, frames, seconds of each step", options={"HIDDEN"}
    )
    done: EnumProperty(
        name="Steps Done",
        description="Steps whose results are in the output folder",
        items=[(stage, title(stage), "") for stage in STAGES],
        options={"ENUM_FLAG"},
    )


def sequence_object(context) -> bpy.types.Object | None:
    """The mesh-sequence object that the active object is or belongs to, else the only one in the scene, else None."""
    active = context.active_object
    if active is not None:
        owner = active if active.refmesh.frames else active.refmesh.sequence
        if owner is not None:
            return owner
    found = [candidate for candidate in context.scene.objects if candidate.refmesh.frames]
    return found[0] if len(found) == 1 else None


CLASSES = (RefMeshSettings, RefMeshFrame, RefMeshFinding, RefMeshGroup, RefMeshSequence)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Object.refmesh = PointerProperty(type=RefMeshSequence, name="RefMesh")
    bpy.types.TimelineMarker.refmesh_sequence = PointerProperty(
        type=bpy.types.Object, name="Sequence", description="The mesh-sequence object whose group of frames begins here"
    )


def unregister():
    del bpy.types.TimelineMarker.refmesh_sequence
    del bpy.types.Object.refmesh
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
