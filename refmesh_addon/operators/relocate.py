"""Points a sequence at its frames again after they were moved, or after some have come or gone."""

import bpy
from bpy.props import StringProperty

from ..core.counted import counted
from ..io.frame_range import format_ranges
from ..properties.selection import sequence_object
from .common import SequenceOperator, absolute, reporting


class REFMESH_OT_relocate_frames(SequenceOperator, bpy.types.Operator):
    """Point the sequence at its frames where they are now: pick any of the files"""

    bl_idname = "refmesh.relocate_frames"
    bl_label = "Find Frames"
    bl_options = {"UNDO"}

    filepath: StringProperty(name="File", description="Any frame of the sequence, or the folder of its frames", subtype="FILE_PATH")

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @reporting
    def execute(self, context):
        from ..bridge.results.relocation import relocate_frames

        owner = sequence_object(context)
        relocate_frames(owner, absolute(self.filepath))
        self.report({"INFO"}, owner.refmesh.missing or f"{counted(len(owner.refmesh.frames), 'frame')} found")
        return {"FINISHED"}


class REFMESH_OT_reload_frames(SequenceOperator, bpy.types.Operator):
    """Look for the frames again: those that were added to the folder join the sequence, and those that were deleted leave it. \
The objects of the results, with all that you have done to them, stay"""

    bl_idname = "refmesh.reload_frames"
    bl_label = "Reload Frames"
    bl_options = {"UNDO"}

    @reporting
    def execute(self, context):
        from ..bridge.results.status import note_other_frames
        from ..bridge.sequence.reload import reload_frames, selected_numbers

        owner = sequence_object(context)
        before = selected_numbers(owner.refmesh)
        reloaded = reload_frames(owner)
        if not reloaded.changed:
            self.report({"INFO"}, "no frame was added or deleted")
            return {"FINISHED"}
        note_other_frames(owner.refmesh, before, selected_numbers(owner.refmesh))
        owner.refmesh.checked = False
        owner.refmesh.findings.clear()
        self.report({"INFO"}, _summary(reloaded, owner.refmesh.done))
        return {"FINISHED"}


def _summary(reloaded, done: set[str]) -> str:
    changes = ((reloaded.added, "added"), (reloaded.removed, "deleted"))
    parts = [f"{counted(len(numbers), 'frame')} {what}: {format_ranges(numbers)}" for numbers, what in changes if numbers]
    if done:
        parts.append("run the steps again for results with these frames")
        if reloaded.moved:
            parts.append("until then, results play where the timeline had their frames before")
    return "; ".join(parts)


CLASSES = (REFMESH_OT_relocate_frames, REFMESH_OT_reload_frames)
