"""Update callbacks: what changes in the scene as soon as a property of a sequence is changed in the panel."""

from __future__ import annotations

from contextlib import contextmanager

import bpy
from mathutils import Vector

from ..core.errors import RefMeshError
from .wording import for_window


def forget_estimates(state, context):
    """Estimates are of another quality now."""
    state.export_estimates = ""


def go_to_finding(state, context):
    """Shows the frame of the finding that was clicked."""
    frame = state.frames.get(state.findings[state.active_finding].name)
    if frame is not None:
        context.scene.frame_set(frame.scene_frame)


def go_to_place(state, context):
    """Shows the frame of the place that was clicked, with the 3D cursor on it."""
    if state.active_place >= len(state.places):
        return
    place = state.places[state.active_place]
    frame = state.frames.get(place.name)
    if frame is None:
        return
    context.scene.frame_set(frame.scene_frame)
    shown = [group.deformed for group in state.groups if group.start <= frame.scene_frame and group.deformed is not None]
    if shown:
        context.scene.cursor.location = shown[-1].matrix_world @ Vector(place.position)


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


def switch_source_colors(state, context):
    """Shows the captured frame in its own colors, or plain."""
    from ..bridge.sequence.raw_sequence import color_shown_frame

    color_shown_frame(state.id_data)


def switch_surface_color(state, context):
    """Shows captured, steady or plain colors."""
    from ..bridge.results.textures import show_surface_color

    show_surface_color(state.id_data)


def relocate_frames(state, context):
    """Points the sequence at its frames in another place; a popup says why that cannot be done."""
    from ..bridge.results.relocation import frames_are_in, relocate_frames
    from ..bridge.scene.paths import absolute_path

    owner = state.id_data
    source = absolute_path(owner, state.source)
    if state.source and len(state.frames) and not frames_are_in(owner, source):
        with _errors_in_popup(context):
            relocate_frames(owner, source)


def replay_corrections(correction, context):
    """Plays the group of a correction anew; a popup says why that cannot be done."""
    from ..bridge.results.corrections import replay

    owner = correction.id_data
    for index, group in enumerate(owner.refmesh.groups):
        if any(item == correction for item in group.corrections):
            with _errors_in_popup(context):
                replay(owner, index)


def switch_errors(state, context):
    """Shows errors as colors, or the plain color again; a popup says why errors cannot be shown."""
    from ..bridge.results.heat_map import switch_heat_map

    with _errors_in_popup(context) as failed:
        switch_heat_map(state.id_data)
    if failed:
        state.heat_map = False


@contextmanager
def _errors_in_popup(context):
    """Shows an error that is meant for the user; gives a list that holds its message afterward."""
    messages = []
    try:
        yield messages
    except RefMeshError as error:
        messages.append(for_window(str(error)))
        if not bpy.app.background:
            context.window_manager.popup_menu(lambda menu, _: menu.layout.label(text=messages[0]), title="RefMesh", icon="ERROR")
