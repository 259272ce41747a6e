"""Which kinds of objects of a sequence are seen: source, centers, reference meshes, result. What is not seen is not rendered."""

from __future__ import annotations

from contextlib import suppress

import bpy

from ...core.errors import RefMeshError
from ..scene.objects import KINDS, kind_collection, move_to_kind
from ..scene.solid_view import color_solid_views
from ..sequence.raw_sequence import show_frame


def switch_kinds(owner: bpy.types.Object) -> None:
    """Shows and hides the collections of the kinds as the switches of the panel say."""
    state = owner.refmesh
    for kind, members in _members(owner).items():
        if not members:
            continue
        for member in members:
            move_to_kind(member, state.root, kind)
        collection = kind_collection(state.root, kind)
        hidden = not getattr(state, f"show_{kind}")
        if (collection.hide_viewport, collection.hide_render) != (hidden, hidden):
            collection.hide_viewport = collection.hide_render = hidden
    with suppress(RefMeshError):  # said at the next change of frame
        if state.show_source:
            show_frame(owner, owner.users_scene[0].frame_current)
    color_solid_views(any(_shows_colors(candidate) for candidate in bpy.data.objects))


def present_kinds(owner: bpy.types.Object) -> set[str]:
    """The kinds that the sequence has objects of."""
    return {kind for kind, members in _members(owner).items() if members}


def show_newest(owner: bpy.types.Object, before: set[str]) -> None:
    """Switches to what a run has added to the kinds that there were `before`; a choice that was made since then stays.

    A result or a reference mesh takes the place of all else; centers are seen in front of the source that they follow.
    """
    new = present_kinds(owner) - before
    newest = next((kind for kind in reversed(KINDS) if kind in new), "")
    if newest:
        _show_only(owner, {"source", "centers"} if newest == "centers" else {newest})
    else:
        switch_kinds(owner)


def show_kinds(owner: bpy.types.Object, side_by_side: bool) -> None:
    """Shows every kind in a row; in one place only the last that there is."""
    last = next(kind for kind in reversed(KINDS) if kind in present_kinds(owner))
    _show_only(owner, set(KINDS) if side_by_side else {last})


def _show_only(owner: bpy.types.Object, shown: set[str]) -> None:
    for kind in KINDS:
        setattr(owner.refmesh, f"show_{kind}", kind in shown)


def is_seen(owner: bpy.types.Object) -> bool:
    """Whether the source is shown or rendered anywhere."""
    return any(not (collection.hide_viewport and collection.hide_render) for collection in owner.users_collection)


def _members(owner: bpy.types.Object) -> dict[str, list[bpy.types.Object]]:
    state = owner.refmesh
    kinds = {
        "source": [owner],
        "centers": [state.centers, state.trails],
        "reference": [group.reference for group in state.groups],
        "result": [group.deformed for group in state.groups],
    }
    return {kind: [member for member in members if member is not None] for kind, members in kinds.items()}


def _shows_colors(owner: bpy.types.Object) -> bool:
    state = owner.refmesh
    return bool(state.frames) and owner.library is None and ((state.centers is not None and state.show_centers) or state.heat_map)
