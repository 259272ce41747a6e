"""Base classes of the panels, and text that wraps."""

from ..properties import wording
from ..properties.selection import sequence_object

DEFAULT_WIDTH = 300  # pixels, where there is no region


class RefMeshPanel:
    """A panel of the RefMesh tab in the sidebar of the 3D view."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RefMesh"


class SequencePanel(RefMeshPanel):
    """A panel about the selected sequence, with a button that opens the documentation of its step."""

    @classmethod
    def poll(cls, context):
        return sequence_object(context) is not None

    def draw_header_preset(self, context):
        self.layout.operator("refmesh.help", text="", icon="HELP", emboss=False).page = self.bl_label.lower()


class CentersPanel(RefMeshPanel):
    """A panel about the centers of the selected sequence, once there are any."""

    @classmethod
    def poll(cls, context):
        owner = sequence_object(context)
        return owner is not None and owner.refmesh.centers is not None


def draw_wrapped(layout, context, text: str, icon: str = "NONE"):
    """Draws text on as many lines as the width of the panel requires."""
    wording.draw_wrapped(layout, text, context.region.width if context.region else DEFAULT_WIDTH, icon)


def describe_seconds(seconds: float) -> str:
    """0.4 as "0.4 s", 12.3 as "12 s", 80 as "1:20 min"."""
    if seconds < 60:
        return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s"
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d} min"
