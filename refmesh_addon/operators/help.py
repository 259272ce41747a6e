"""Opens the documentation of a step in the web browser."""

import webbrowser
from pathlib import Path

import bpy
from bpy.props import EnumProperty

from ..core.errors import RefMeshError
from .common import reporting

PAGES = Path(__file__).resolve().parents[2] / "docs" / "panel"  # in the checkout as in the zip
STEPS = ("sequence", "track", "reference", "deform", "color", "export")


class REFMESH_OT_help(bpy.types.Operator):
    """Open the documentation of this step in the web browser"""

    bl_idname = "refmesh.help"
    bl_label = "Help"
    bl_options = {"INTERNAL"}

    page: EnumProperty(name="Page", description="Step that the page is about", items=[(step, step.title(), "") for step in STEPS])

    @reporting
    def execute(self, context):
        page = PAGES / f"{self.page}.html"
        if not page.is_file():
            raise RefMeshError(f"{page}: the page is missing; install the extension again")
        # Without a window it only reports the path.
        if not bpy.app.background and not webbrowser.open(page.as_uri()):
            raise RefMeshError(f"no web browser can be started: open {page} by hand")
        self.report({"INFO"}, f"{page}")
        return {"FINISHED"}


CLASSES = (REFMESH_OT_help,)
