"""Whether what the work needs is there and can be loaded."""

import bpy

from ..core.errors import RefMeshError
from ..pipeline.process.packages import check_packages
from .common import reporting


class REFMESH_OT_check_installation(bpy.types.Operator):
    """Load every package that RefMesh needs, in the Python that does its work, and say what is missing or broken"""

    bl_idname = "refmesh.check_installation"
    bl_label = "Check Installation"

    @reporting
    def execute(self, context):
        versions, troubles = check_packages()
        if troubles:
            raise RefMeshError("; ".join(troubles))
        self.report({"INFO"}, f"everything is there: {', '.join(' '.join(item).strip() for item in versions.items())}")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_check_installation,)
