"""Changes to the input of the next run; only results that depend on them are computed again."""

import bpy
from bpy.props import EnumProperty

from ..core.errors import RefMeshError
from ..io.frame_range import format_selection, parse_ranges
from ..properties.selection import sequence_object
from .common import SequenceOperator, reporting


class REFMESH_OT_exclude_frame(SequenceOperator, bpy.types.Operator):
    """Exclude the current frame from the next run; the mesh then moves on over it, as over a missing frame"""

    bl_idname = "refmesh.exclude_frame"
    bl_label = "Exclude Current Frame"
    bl_options = {"UNDO"}

    @reporting
    def execute(self, context):
        from ..bridge.sequence.raw_sequence import frame_at

        owner = sequence_object(context)
        state = owner.refmesh
        excluded = int(frame_at(owner, context.scene.frame_current).name)
        everything = [int(frame.name) for frame in state.frames]
        chosen = parse_ranges(state.frame_selection)
        kept = [number for number in everything if number != excluded and (not chosen or any(number in item for item in chosen))]
        if not kept:
            raise RefMeshError(f"frame {excluded} is the only one left; clear the field Frames to use all frames again")
        state.frame_selection = format_selection(kept, everything)
        self.report({"INFO"}, f"frame {excluded} is excluded: frames {state.frame_selection} remain")
        return {"FINISHED"}


CHANGES = [
    ("MARKERS", "Groups from Markers", "Groups begin at their markers: drag these on the timeline first"),
    ("SPLIT", "Begin Group Here", "A group begins at the current frame"),
    ("JOIN", "Join with Group Before", "The group of the current frame is joined with the one before it"),
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
        return next(description for change, _, description in CHANGES if change == properties.change)

    @classmethod
    def poll_failure(cls, context):
        owner = sequence_object(context)
        failure = super().poll_failure(context)
        return failure or ("" if len(owner.refmesh.groups) else "there are no groups yet; run the Reference step first")

    @reporting
    def execute(self, context):
        owner = sequence_object(context)
        starts = self._changed_starts(context, owner)
        if starts == self._present_starts(owner):
            self.report({"INFO"}, f"nothing to change: groups begin at {', '.join(map(str, sorted(starts)))} already")
            return {"CANCELLED"}
        owner.refmesh.settings.group_starts = ",".join(map(str, sorted(starts)))
        self.report({"INFO"}, f"groups begin at {owner.refmesh.settings.group_starts}; run Reference to see them")
        return {"FINISHED"}

    def _changed_starts(self, context, owner) -> set[int]:
        """Numbers of the frames at which groups are to begin."""
        from ..bridge.scene.markers import markers_of
        from ..bridge.sequence.raw_sequence import frame_at

        if self.change == "MARKERS":
            return {int(frame_at(owner, marker.frame).name) for marker in markers_of(owner, context.scene)}
        starts, current = self._present_starts(owner), int(frame_at(owner, context.scene.frame_current).name)
        if self.change == "SPLIT":
            return starts | {current}
        earlier = [start for start in sorted(starts) if start <= current]
        if len(earlier) < 2:
            raise RefMeshError("this is the first group: go to a later one to join it with the group before it")
        return starts - {earlier[-1]}

    def _present_starts(self, owner) -> set[int]:
        """Those that the settings request, else those of the results."""
        from ..bridge.sequence.raw_sequence import frame_at

        state = owner.refmesh
        if state.settings.group_starts.strip():
            return {int(number) for number in state.settings.group_starts.split(",")} | {int(state.frames[0].name)}
        return {int(frame_at(owner, group.start).name) for group in state.groups}


CLASSES = (REFMESH_OT_exclude_frame, REFMESH_OT_edit_groups)
