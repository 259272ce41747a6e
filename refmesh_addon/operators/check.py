"""The sequence doctor: what may be wrong with the frames, before hours of work go into them."""

import bpy

from ..core.findings import SEVERITIES
from ..io.findings import CHECK_TEXT, read_findings
from .common import absolute
from .job import JobOperator


class REFMESH_OT_check_sequence(JobOperator, bpy.types.Operator):
    """Look at every frame: unreadable, empty or doubled ones, gaps, jumps in size, vertex count and volume, holes, flipped \
surfaces, missing textures. Prepares the frames for smooth playback on the way"""

    bl_idname = "refmesh.check_sequence"
    bl_label = "Check Sequence"
    until = "sequence"

    def parts(self):
        yield self._show

    def _show(self, owner):
        state = owner.refmesh
        output = absolute(state.output)
        findings = read_findings(output)
        state.findings.clear()
        for finding in findings:
            item = state.findings.add()
            item.name, item.severity, item.words = str(finding.frame), finding.severity, finding.message
        state.checked = True
        counts = {severity: sum(finding.severity == severity for finding in findings) for severity in SEVERITIES}
        words = ", ".join(f"{count} {severity}{'s' if count > 1 else ''}" for severity, count in counts.items() if count)
        self.report({"INFO"}, f"{words or 'nothing found'}; see {output / CHECK_TEXT}")


CLASSES = (REFMESH_OT_check_sequence,)
