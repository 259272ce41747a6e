"""The state of a sequence in the scene.

No `from __future__ import annotations` here: Blender reads the annotations as values.
"""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..core.findings import CENTER_ATTRIBUTES
from ..core.options import title
from ..core.settings import STAGES
from .settings import RefMeshSettings
from .updates import (
    arrange_objects,
    forget_estimates,
    go_to_finding,
    go_to_group,
    go_to_place,
    relocate_frames,
    replay_corrections,
    restyle_centers,
    switch_errors,
    switch_kinds,
    switch_source_colors,
    switch_surface_color,
)

# Says that a path may begin with "//"; unknown before Blender 4.5.
RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5) else set()
EXPORT_QUALITIES = [
    ("small", "Small", "For previews and slow networks: errors of about 0.1 % of the size"),
    ("balanced", "Balanced", "Errors of about 0.05 % of the size"),
    ("near_lossless", "Near Lossless", "Errors of about 0.01 % of the size, all triangles where they are needed"),
]
UNKNOWN = -1.0  # a distance that has not been measured


class RefMeshFrame(bpy.types.PropertyGroup):
    """One frame of a sequence; `name` holds its number, which may be a time stamp too long for a Blender integer."""

    path: StringProperty(name="File", description="The mesh of this frame", subtype="FILE_PATH", options=RELATIVE)
    scene_frame: IntProperty(name="Scene Frame", description="Frame of the timeline from which this mesh is shown")
    distance: FloatProperty(name="Distance", description="Mean distance to the deformed mesh, share of the diagonal", default=UNKNOWN)
    overstretched: FloatProperty(
        name="Overstretched", description="Share of the surface whose triangles are stretched more than threefold", default=UNKNOWN
    )
    bad: StringProperty(name="Bad", description="What is lost or doubled in this frame, so that it is not fitted")


class RefMeshFinding(bpy.types.PropertyGroup):
    """One result of checking the sequence; `name` holds the number of the frame."""

    severity: StringProperty(name="Severity", description="Error, warning or note")
    message: StringProperty(name="Finding", description="What may be wrong with the frame")


class RefMeshPlace(bpy.types.PropertyGroup):
    """A place at which a frame and its source are far apart; `name` holds the number of the frame."""

    kind: StringProperty(name="Kind", description="extra: surface that the source does not show; missing: source that the result lacks")
    distance: FloatProperty(name="Distance", description="Largest distance there, share of the diagonal")
    position: FloatVectorProperty(name="Position", description="Of that point, as the deformed mesh is stored")


class RefMeshCorrection(bpy.types.PropertyGroup):
    """A correction of the deformed mesh of a group; `name` is shown in the list."""

    layer: StringProperty(name="Offsets", description="Attribute of the deformed mesh that holds the offsets", options={"HIDDEN"})
    mute: BoolProperty(name="Mute", description="Show the deformed mesh without this correction", update=replay_corrections)
    first: IntProperty(name="First", description="Scene frame from which it applies in full", update=replay_corrections)
    last: IntProperty(name="Last", description="Scene frame up to which it applies in full", update=replay_corrections)
    fade: IntProperty(name="Fade", description="Frames over which it fades in before and fades out after", min=0, update=replay_corrections)


class RefMeshGroup(bpy.types.PropertyGroup):
    """The two objects of one group of frames."""

    start: IntProperty(name="Start", description="Scene frame from which this group is shown")
    reason: StringProperty(name="Reason", description="Why another mesh begins here")
    reference: PointerProperty(type=bpy.types.Object, name="Reference Mesh", description="Reference mesh of this group")
    deformed: PointerProperty(type=bpy.types.Object, name="Deformed Mesh", description="Reference mesh as it moves through this group")
    kept: PointerProperty(
        type=bpy.types.Object, name="Kept Mesh", description="Deformed mesh with work on it, until there are results for it again"
    )
    cache: StringProperty(
        name="Cache", description="Point cache of the results, without corrections", subtype="FILE_PATH", options={"HIDDEN", *RELATIVE}
    )
    corrections: CollectionProperty(type=RefMeshCorrection)
    active_correction: IntProperty(name="Correction", description="The one whose frames are shown below the list")
    is_edited: BoolProperty(name="Edited", description="Whether playback is off, so that the mesh can be edited", options={"HIDDEN"})
    edited_frame: IntProperty(name="Edited Frame", description="Scene frame whose shape is edited", options={"HIDDEN"})


class RefMeshSequence(bpy.types.PropertyGroup):
    """State of one sequence, stored on its mesh object; its other objects only point to that one through `sequence`."""

    sequence: PointerProperty(type=bpy.types.Object, name="Sequence", description="The mesh-sequence object this object belongs to")
    source: StringProperty(
        name="Source",
        description="Folder, file or pattern that the frames come from; where they were moved, choose one of them here",
        subtype="FILE_PATH",
        options=RELATIVE,
        update=relocate_frames,
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
    checked: BoolProperty(name="Checked", description="Whether every frame was checked", options={"HIDDEN"})
    bodies: StringProperty(name="Bodies", description="The bodies of the take, one in a line", options={"HIDDEN"})
    places: CollectionProperty(type=RefMeshPlace)
    active_place: IntProperty(name="Place", description="Click a place to go to its frame and set the 3D cursor there", update=go_to_place)
    source_colors: BoolProperty(
        name="Capture Colors",
        description="Show and render the captured frames in their own colors, which takes time where a frame is shown for the first time",
        default=False,
        update=switch_source_colors,
    )
    shown: StringProperty(name="Shown Frame", description="Number of the frame whose mesh the object holds now", options={"HIDDEN"})
    root: PointerProperty(type=bpy.types.Object, name="Root", description="Empty that all objects of this sequence are parented to")
    centers: PointerProperty(type=bpy.types.Object, name="Centers", description="Points that follow the volume")
    center_color: EnumProperty(
        name="Colored by",
        description="What the colors of the centers show",
        items=[
            ("PLACE", "Place", "Where a center is in the first frame, to see which part moved where"),
            *((name.upper(), title(name), meaning) for name, meaning in CENTER_ATTRIBUTES.items()),
        ],
        update=restyle_centers,
    )
    center_size: FloatProperty(
        name="Size", description="Of the centers; at 4, neighbors touch", default=1.0, min=0.01, soft_max=4.0, update=restyle_centers
    )
    center_spacing: FloatProperty(name="Spacing", description="Usual distance of neighboring centers", options={"HIDDEN"})
    center_range: StringProperty(name="Range", description="What the colors of the centers mean", options={"HIDDEN"})
    trails: PointerProperty(type=bpy.types.Object, name="Trails", description="Paths of chosen centers")
    groups: CollectionProperty(type=RefMeshGroup)
    own_mesh: PointerProperty(type=bpy.types.Mesh, name="Own Mesh", description="Mesh of your own that is deformed to the whole take")
    active_group: IntProperty(name="Group", description="Click a group to go to its first frame", update=go_to_group)
    arrangement: EnumProperty(
        name="Arrangement",
        description="Where centers, reference mesh and result stand beside the source",
        items=[
            ("OVERLAY", "In Place", "All where the source is; the switches say which are shown"),
            ("SIDE", "Side by Side", "Source, centers, reference mesh and result in a row, all of them shown"),
        ],
        update=arrange_objects,
    )
    show_source: BoolProperty(
        name="Source",
        description="Show and render the captured frames. Without RefMesh, a saved scene shows the frame it was saved with",
        default=True,
        update=switch_kinds,
    )
    show_centers: BoolProperty(name="Centers", description="Show and render the tracked centers", default=True, update=switch_kinds)
    show_reference: BoolProperty(name="Reference", description="Show and render the reference meshes", default=True, update=switch_kinds)
    show_result: BoolProperty(name="Result", description="Show and render the deformed meshes", default=True, update=switch_kinds)
    heat_map: BoolProperty(
        name="Show Errors",
        description="Color the deformed mesh by its distance to the source: dark for none, yellow for 0.2 % of the diagonal and more",
        update=switch_errors,
    )
    surface_color: EnumProperty(
        name="Show",
        description="Colors of the deformed mesh; Show Errors takes precedence",
        items=[
            ("CAPTURED", "Captured", "The capture's own colors, frame by frame", "", 0),
            ("STEADY", "Steady", "One texture per reference mesh, to be painted and relit", "", 1),
            ("PAINTED", "Painted", "The steady texture that you painted on before the last run; the steady one where there is none", "", 3),
            ("PLAIN", "Plain", "One color", "", 2),
        ],
        update=switch_surface_color,
    )
    heat_map_frame: StringProperty(
        name="Frame of the Errors", description="Number of the frame whose errors the mesh shows now", options={"HIDDEN"}
    )
    side_step: FloatProperty(name="Distance", description="Between source, reference mesh and result", options={"HIDDEN"})
    settings: PointerProperty(type=RefMeshSettings)
    export_quality: EnumProperty(
        name="Quality",
        description="Of small files: small GLB, web page and RefMesh stream",
        items=EXPORT_QUALITIES,
        default="balanced",
        update=forget_estimates,
    )
    export_estimates: StringProperty(name="Estimates", description="Expected size and error of small files", options={"HIDDEN"})
    exported: StringProperty(name="Exported", description="Size and error of what was exported last", options={"HIDDEN"})
    missing: StringProperty(
        name="Missing", description="Files that the scene needs and that were missing when it was opened", options={"HIDDEN"}
    )
    results: StringProperty(
        name="Results", description="How the results were computed, as JSON: settings, frames, seconds of each step", options={"HIDDEN"}
    )
    done: EnumProperty(
        name="Steps Done",
        description="Steps whose results are in the output folder",
        items=[(stage, title(stage), "") for stage in STAGES],
        options={"ENUM_FLAG"},
    )


CLASSES = (RefMeshFrame, RefMeshFinding, RefMeshPlace, RefMeshCorrection, RefMeshGroup, RefMeshSequence)
