"""Says, once Blender has started, which Python packages are missing and how to get them."""

import sys

import bpy

from ..pipeline.process.packages import ESSENTIAL, how_to_install, missing_names
from ..properties.wording import draw_wrapped

DELAY = 1.0  # seconds after which the window is there
WIDTH = 460  # pixels at a resolution scale of 1


def missing_essentials() -> str:
    """Which packages are missing without which nothing runs, and how to get them; "" when none is."""
    missing = [name for name in ESSENTIAL if name in missing_names()]
    if not missing:
        return ""
    return f"RefMesh needs Python packages that this Blender does not have: {', '.join(missing)}. {how_to_install(missing)}"


def _pop_up():
    text = missing_essentials()

    def draw(menu, context):
        draw_wrapped(menu.layout, text, WIDTH * context.preferences.system.ui_scale)

    bpy.context.window_manager.popup_menu(draw, title="RefMesh", icon="ERROR")


def register():
    text = missing_essentials()
    if not text:
        return
    print(text, file=sys.stderr)  # what `blender --command extension install-file --enable` shows
    if not bpy.app.background:
        bpy.app.timers.register(_pop_up, first_interval=DELAY)


def unregister():
    if bpy.app.timers.is_registered(_pop_up):
        bpy.app.timers.unregister(_pop_up)
