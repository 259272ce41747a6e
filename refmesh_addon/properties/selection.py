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
    found = [candidate for candidate in context.scene.objects if candidate.refmesh.frames]
    return found[0] if len(found) == 1 else None


def _owner_of(member) -> bpy.types.Object | None:
    """The sequence that an object is or belongs to; for an Empty that shows a linked collection, the one in the collection."""
    if member.instance_collection is not None:
        return next((candidate for candidate in member.instance_collection.all_objects if candidate.refmesh.frames), None)
    return member if member.refmesh.frames else member.refmesh.sequence
