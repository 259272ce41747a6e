"""The color scale of the errors, drawn over the 3D view."""

import blf
import bpy
import numpy as np

from ..core.evaluation.error_scale import TABLE, TOP
from ..properties.selection import sequence_object

SIZE = (220, 14)  # of the bar, pixels at a resolution scale of 1
PLACE = (70, 60)  # of its lower left corner, to the right of the toolbar
LETTERS = 12  # points
CAPTION = "Distance to the source, % of the diagonal"


def draw():
    """Called by Blender for every 3D view; draws where the active sequence shows its errors."""
    owner = sequence_object(bpy.context)
    if owner is None or not owner.refmesh.heat_map or not bpy.context.space_data.overlay.show_overlays:
        return
    scale = bpy.context.preferences.system.ui_scale
    (x, y), (width, height) = (scale * np.array(pair) for pair in (PLACE, SIZE))
    _bar(x, y, width, height)
    blf.size(0, LETTERS * scale)
    blf.color(0, 1.0, 1.0, 1.0, 1.0)
    _write(CAPTION, x, y + 1.5 * height)
    for share in (0.0, 0.5, 1.0):
        label = f"{100 * TOP * share:g}" + (" and more" if share == 1.0 else "")
        _write(label, x + share * width - (3 * scale if share else 0), y - 1.2 * height)


def _bar(x, y, width, height):
    import gpu  # late: it fails to load without a window
    from gpu_extras.batch import batch_for_shader

    across = np.linspace(x, x + width, len(TABLE))
    points = [(place, level, 0.0) for place in across for level in (y, y + height)]
    colors = [(*color, 1.0) for color in TABLE.tolist() for _ in range(2)]
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    batch_for_shader(shader, "TRI_STRIP", {"pos": points, "color": colors}).draw(shader)


def _write(text, x, y):
    blf.position(0, x, y, 0)
    blf.draw(0, text)


_handle = None


def register():
    global _handle
    if not bpy.app.background:
        _handle = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_PIXEL")


def unregister():
    global _handle
    if _handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
        _handle = None
