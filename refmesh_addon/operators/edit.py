"""Changes to what the next run works on; only what depends on them is computed again."""

import bpy
from bpy.props import EnumProperty

from ..core.errors import RefMeshError
from ..io.frame_range import as_choice, parse_ranges
from ..properties import sequence_object
from .common import SequenceOperator, reporting


class REFMESH_OT_exclude_frame(SequenceOperator, bpy.types.Operator):
    """Leave the frame that the timeline shows out of the next run; the frame before it is then held"""

    bl_idname = "refmesh.exclude_frame"
    bl_label = "Exclude Current Frame"
    bl_options = {"UNDO"}

    @reporting
    def execute(self, context):
        from ..bridge.sequence.raw_sequence import frame_at

        owner = sequence_object(context)
        state = owner.refmesh
        unwanted = int(frame_at(owner, context.scene.frame_current).name)
        everything = [int(frame.name) for frame in state.frames]
        chosen = parse_ranges(state.frame_selection)
        kept = [number for number in everything if number != unwanted and (not chosen or any(number in item for item in chosen))]
        if not kept:
            raise RefMeshError(f"frame {unwanted} is the only one left; empty the field Frames to take all again")
        state.frame_selection = as_choice(kept, everything)
        self.report({"INFO"}, f"frame {unwanted} is left out: frames {state.frame_selection} remain")
        return {"FINISHED"}


CHANGES = [
    ("MARKERS", "Groups from Markers", "Groups begin where their markers are now: drag them on the timeline first"),
    ("SPLIT", "Begin Group Here", "A group begins at the frame that the timeline shows"),
    ("JOIN", "Join with Group Before", "The group that the timeline shows is joined with the one before it"),
]


class REFMESH_OT_edit_groups(SequenceOperator, bpy.types.Operator):
    """Change where groups of frames begin"""

    bl_idname = "refmesh.edit_groups"
    bl_label = "Edit Groups"
    bl_options = {"UNDO"}

    change: EnumProperty(
        name="Change",
        description="What to change",
        items=CHANGES,
    )

    @classmethod
    def description(cls, context, properties):
        return next(words for change, _, words in CHANGES if change == properties.change)

    @classmethod
    def hindrance(cls, context):
        owner = sequence_object(context)
        hindrance = super().hindrance(context)
        return hindrance or ("" if len(owner.refmesh.groups) else "there are no groups yet; run the Reference step first")

    @reporting
    def execute(self, context):
        from ..bridge.scene.markers import markers_of
        from ..bridge.sequence.raw_sequence import frame_at

        owner = sequence_object(context)
        state = owner.refmesh
        starts = {int(frame_at(owner, group.start).name) for group in state.groups}
        if state.settings.group_starts.strip():
            starts = {int(word) for word in state.settings.group_starts.split(",")} | {int(state.frames[0].name)}
        here = int(frame_at(owner, context.scene.frame_current).name)
        if self.change == "MARKERS":
            starts = {int(frame_at(owner, marker.frame).name) for marker in markers_of(owner, context.scene)}
        elif self.change == "SPLIT":
            starts.add(here)
        else:
            earlier = [start for start in sorted(starts) if start <= here]
            if len(earlier) < 2:
                raise RefMeshError("this is the first group: go to a later one to join it with the one before")
            starts.remove(earlier[-1])
        state.settings.group_starts = ",".join(map(str, sorted(starts)))
        self.report({"INFO"}, f"groups begin at {state.settings.group_starts}; run Reference to see them")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_exclude_frame, REFMESH_OT_edit_groups)
