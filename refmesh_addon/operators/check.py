"""Checks the frames for defects before hours of computation go into them."""

from dataclasses import replace

import bpy

from ..bridge.scene.focus import longest_side
from ..core.capture.scale import scale_note
from ..core.counted import counted
from ..core.findings import SEVERITIES
from ..io.findings import CHECK_TEXT, read_findings, read_kind
from .common import absolute
from .job import JobOperator


class REFMESH_OT_check_sequence(JobOperator, bpy.types.Operator):
    """Check every frame for defects: unreadable, empty or duplicate frames, gaps, jumps in size, vertex count and volume, holes, \
flipped surfaces, missing textures, frames without volume. Also prepares the frames for smooth playback"""

    bl_idname = "refmesh.check_sequence"
    bl_label = "Check Sequence"
    until = "sequence"

    def _spec(self, state):
        """The job with a note on an unusual size, which depends on the unit that only the scene knows."""
        owner = state.id_data
        note = scale_note(longest_side(owner, owner.users_scene[0]))
        return replace(super()._spec(state), notes=(note,) if note else ())

    def scene_updates(self):
        yield self._show_findings

    def _show_findings(self, owner):
        state = owner.refmesh
        output = absolute(state.output)
        findings = read_findings(output)
        state.findings.clear()
        for finding in findings:
            item = state.findings.add()
            item.name, item.severity, item.message = str(finding.frame), finding.severity, finding.message
        state.checked = True
        counts = {severity: sum(finding.severity == severity for finding in findings) for severity in SEVERITIES}
        summary = ", ".join(counted(count, severity) for severity, count in counts.items() if count)
        kind = read_kind(output)
        self.report({"INFO"}, f"{kind and kind + '; '}{summary or 'nothing found'}; see {output / CHECK_TEXT}")


CLASSES = (REFMESH_OT_check_sequence,)
