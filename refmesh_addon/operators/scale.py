"""Scales a sequence whose unit is another one than was assumed."""

import bpy
from bpy.props import FloatProperty

from ..core.errors import RefMeshError
from ..properties.selection import sequence_object
from .common import SequenceOperator, reporting


class REFMESH_OT_scale_sequence(SequenceOperator, bpy.types.Operator):
    """Scale the sequence with all its results, through the root object; data and results stay in the coordinates of the files"""

    bl_idname = "refmesh.scale_sequence"
    bl_label = "Scale Sequence"
    bl_options = {"REGISTER", "UNDO"}

    factor: FloatProperty(name="Factor", description="0 takes the factor that makes it as large as a person", default=0.0, min=0.0)

    @reporting
    def execute(self, context):
        from ..bridge.scene.far_origin import scale_root
        from ..bridge.scene.focus import frame_selected, longest_side
        from ..bridge.scene.timeline import widen_clipping
        from ..core.capture.scale import meters, scale_suggestion

        owner = sequence_object(context)
        factor = self.factor or scale_suggestion(longest_side(owner, context.scene))
        if factor == 1.0:
            raise RefMeshError("the sequence has a usual size; give a factor to scale it all the same")
        scale_root(owner.refmesh.root, factor)
        context.view_layer.update()
        longest = longest_side(owner, context.scene)
        widen_clipping(longest / context.scene.unit_settings.scale_length)
        frame_selected()
        _resolve_finding(owner.refmesh.findings)
        self.report({"INFO"}, f"scaled by {factor:g}: {meters(longest)} m long now")
        return {"FINISHED"}


def _resolve_finding(findings) -> None:
    """Takes the note on the size off the list of the check."""
    from ..core.capture.scale import ADVICE

    for index in reversed([index for index, finding in enumerate(findings) if ADVICE in finding.message]):
        findings.remove(index)


CLASSES = (REFMESH_OT_scale_sequence,)
