"""Update callbacks: what changes in the scene as soon as a property of a sequence is changed in the panel."""

from __future__ import annotations

import bpy

from ..core.errors import RefMeshError
from .wording import for_window


def go_to_finding(state, context):
    """Shows the frame of the finding that was clicked."""
    frame = state.frames.get(state.findings[state.active_finding].name)
    if frame is not None:
        context.scene.frame_set(frame.scene_frame)


def go_to_group(state, context):
    """Shows the first frame of the group that was clicked."""
    if state.active_group < len(state.groups):
        context.scene.frame_set(max(state.groups[state.active_group].start, state.frames[0].scene_frame))


def arrange_objects(state, context):
    """Places the objects side by side, all of them seen, or in one place, where only the result is."""
    from ..bridge.results.groups import arrange
    from ..bridge.results.visibility import show_kinds

    arrange(state.id_data)
    show_kinds(state.id_data, state.arrangement == "SIDE")


def switch_kinds(state, context):
    """Shows and hides source, centers, reference meshes and result."""
    from ..bridge.results.visibility import switch_kinds

    switch_kinds(state.id_data)


def restyle_centers(state, context):
    """Draws the centers in their new size and colors."""
    from ..bridge.results.centers import restyle_centers

    restyle_centers(state.id_data)


def switch_surface_color(state, context):
    """Shows captured, steady or plain colors."""
    from ..bridge.results.textures import show_surface_color

    show_surface_color(state.id_data)


def switch_errors(state, context):
    """Shows errors as colors, or the plain color again; a popup says why errors cannot be shown."""
    from ..bridge.results.heat_map import switch_heat_map

    try:
        switch_heat_map(state.id_data)
    except RefMeshError as error:
        message = for_window(str(error))
        state.heat_map = False
        if not bpy.app.background:
            context.window_manager.popup_menu(lambda menu, _: menu.layout.label(text=message), title="RefMesh", icon="ERROR")
