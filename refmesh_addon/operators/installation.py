"""Checks that every package is installed and loads."""

import bpy

from ..core.errors import RefMeshError
from ..pipeline.process.packages import check_packages
from .common import reporting, wait_cursor


class REFMESH_OT_check_installation(bpy.types.Operator):
    """Load every package that RefMesh needs in a worker process and report what is missing or broken"""

    bl_idname = "refmesh.check_installation"
    bl_label = "Check Installation"

    @reporting
    def execute(self, context):
        with wait_cursor(context):
            versions, problems = check_packages()
        if problems:
            raise RefMeshError("; ".join(problems))
        self.report({"INFO"}, f"all packages are installed: {', '.join(' '.join(item).strip() for item in versions.items())}")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_check_installation,)
