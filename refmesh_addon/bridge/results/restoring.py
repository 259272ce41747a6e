"""Objects of a sequence that were deleted in the scene, or whose mesh no longer plays: how both are noticed and put right.

Blender keeps an object that is deleted as long as the sequence points at it, but in no collection.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import bpy
import numpy as np

from ...core.errors import RefMeshError
from ...io.pc2 import pc2_shape
from ..scene.objects import KIND, kind_collection, new_root
from ..scene.playback import CACHE_NAME, cache_path


def all_fit(owner: bpy.types.Object) -> bool:
    """Whether every deformed mesh fits its point cache; one that is being edited need not."""
    return all(group.is_edited or group.deformed is None or fits_cache(group.deformed) for group in owner.refmesh.groups)


def fits_cache(member: bpy.types.Object) -> bool:
    """Whether the mesh plays a point cache with as many points as it has vertices; Blender shows the rest shape of one that does not.

    A cache that is missing or damaged is named where it is read.
    """
    if CACHE_NAME not in member.modifiers:
        return False
    with suppress(RefMeshError):
        return pc2_shape(cache_path(member))[1] == len(member.data.vertices)
    return True


def restore_deleted(owner: bpy.types.Object) -> str:
    """Links the objects of a sequence that were deleted into its collections again. Returns what a person is told; "" for none."""
    state, told = owner.refmesh, []
    if state.root is None:  # removed by a script: its rotation and scale are gone with it
        state.root = _new_root(owner)
        told.append("an Empty that everything is parented to, as the root was deleted")
    deleted = [(kind, member) for kind, member in _members(owner) if not member.users_collection]
    if any(member == state.root for _, member in deleted):
        _home(owner).objects.link(state.root)
    for kind, member in deleted:
        if member != state.root:
            kind_collection(state.root, kind).objects.link(member)
    told += [member.name for _, member in deleted]
    return f"deleted objects are back: {', '.join(told)}" if told else ""


def _members(owner: bpy.types.Object) -> Iterator[tuple[str, bpy.types.Object]]:
    """(kind, object) of all that there are."""
    state = owner.refmesh
    members = [("root", state.root), ("source", owner), ("centers", state.centers)]
    for group in state.groups:
        members += [("reference", group.reference), ("result", group.deformed)]
    return ((kind, member) for kind, member in members if member is not None)


def _home(owner: bpy.types.Object) -> bpy.types.Collection:
    """The collection around those of the kinds; a new one where they are gone as well."""
    kinds = {collection for _, member in _members(owner) for collection in member.users_collection if KIND in collection}
    around = (parent for parent in bpy.data.collections if kinds & set(parent.children))
    home = next(around, None)
    if home is None:
        home = bpy.data.collections.new(owner.name.removesuffix(" source"))
        bpy.context.scene.collection.children.link(home)
    return home


def _new_root(owner: bpy.types.Object) -> bpy.types.Object:
    root = new_root(bpy.context.scene, owner.name.removesuffix(" source"), "Z", 1.0, np.zeros(3))
    root.refmesh.sequence = owner
    for _, member in _members(owner):
        member.parent = root
    return root
