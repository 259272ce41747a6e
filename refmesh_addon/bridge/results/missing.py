"""Results and frames that are not where a scene expects them."""

from __future__ import annotations

import bpy

from ...io.report import REPORT_NAME
from ..scene.paths import absolute_path, library_of
from ..scene.playback import CACHE_NAME, cache_path


def missing_files(owner: bpy.types.Object) -> str:
    """Says which file that a sequence needs is missing, and what to do; "" when none is."""
    state = owner.refmesh
    first = absolute_path(owner, state.frames[0].path)
    if not first.is_file():
        return f"the frames are not in {first.parent}: move them back, or choose one of them as Source"
    if not state.done:
        return ""
    needed = [absolute_path(owner, state.output) / REPORT_NAME]
    members = [state.centers, *(group.deformed for group in state.groups)]
    needed += [cache_path(member) for member in members if member is not None and CACHE_NAME in member.modifiers]
    missing = next((path for path in needed if not path.is_file()), None)
    return f"{missing} is missing: choose its folder as Output and press Load Results, or run the steps again" if missing else ""


def linked_note(owner: bpy.types.Object) -> str:
    """What a sequence that is linked from another .blend can do here; "" for one of this file."""
    library = library_of(owner) or owner.data.library
    if library is None:
        return ""
    return (
        f"linked from {library.filepath}: the result plays here, the source shows frame {owner.refmesh.shown} only, because Blender "
        "does not let add-ons change linked meshes; open that file to change it or to play the source"
    )
