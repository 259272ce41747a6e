"""Opens the documentation of a step."""

from pathlib import Path

import bpy
from bpy.props import EnumProperty

from ..core.errors import RefMeshError
from .common import reporting

PAGES = Path(__file__).resolve().parents[2] / "docs" / "panel"  # in the checkout as in the zip
STEPS = ("sequence", "track", "reference", "deform", "export")


class REFMESH_OT_help(bpy.types.Operator):
    """Open the documentation of this step"""

    bl_idname = "refmesh.help"
    bl_label = "Help"
    bl_options = {"INTERNAL"}

    page: EnumProperty(name="Page", description="Step that the page is about", items=[(step, step.title(), "") for step in STEPS])

    @reporting
    def execute(self, context):
        page = PAGES / f"{self.page}.md"
        if not page.is_file():
            raise RefMeshError(f"{page}: the page is missing; install the extension again")
        if not bpy.app.background:  # without a window it only reports the path
            bpy.ops.wm.path_open(filepath=str(page))
        self.report({"INFO"}, f"{page}")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_help,)
