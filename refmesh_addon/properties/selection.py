"""Which sequence panels and operators are about."""

from __future__ import annotations

import bpy


def sequence_object(context) -> bpy.types.Object | None:
    """The mesh-sequence object that the active object is or belongs to, else the only one in the scene, else None."""
    active = context.active_object
    if active is not None:
        owner = active if active.refmesh.frames else active.refmesh.sequence
        if owner is not None:
            return owner
    found = [candidate for candidate in context.scene.objects if candidate.refmesh.frames]
    return found[0] if len(found) == 1 else None
