"""Which sequence panels and operators are about."""

from __future__ import annotations

import bpy


def sequence_object(context) -> bpy.types.Object | None:
    """The mesh-sequence object that the active object is or belongs to, else the only one in the scene, else None."""
    active = context.active_object
    if active is not None:
        owner = _owner_of(active)
        if owner is not None:
            return owner
    sequences = [candidate for candidate in context.scene.objects if candidate.refmesh.frames]
    return sequences[0] if len(sequences) == 1 else None


def _owner_of(member) -> bpy.types.Object | None:
    """The sequence that an object is or belongs to; for an Empty that shows a linked collection, the one in the collection."""
    if member.instance_collection is not None:
        return next((candidate for candidate in member.instance_collection.all_objects if candidate.refmesh.frames), None)
    return member if member.refmesh.frames else member.refmesh.sequence


def edited_group(context) -> int | None:
    """Number of the group whose deformed or reference mesh is active, else of the one that the current frame shows; None without groups."""
    owner = sequence_object(context)
    groups = owner.refmesh.groups if owner is not None else ()
    active = context.active_object
    for index, group in enumerate(groups):
        if active is not None and active in (group.deformed, group.reference):
            return index
    started = [index for index, group in enumerate(groups) if group.start <= context.scene.frame_current]
    return started[-1] if started else (0 if len(groups) else None)
