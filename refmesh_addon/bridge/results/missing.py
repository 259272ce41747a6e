"""Results and frames that are not where a scene expects them, found when it is opened."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...io.report import REPORT_NAME
from ..scene.playback import CACHE_NAME, cache_path


def missing_files(owner: bpy.types.Object) -> str:
    """The first file that a sequence needs and that is not there, in words; "" when all are."""
    state = owner.refmesh
    first = _absolute(state.frames[0].path)
    if not first.is_file():
        return f"the frames are not at {first.parent}: put them back, or import the sequence from where they are"
    if not state.done:
        return ""
    needed = [_absolute(state.output) / REPORT_NAME]
    members = [state.centers, *(group.deformed for group in state.groups)]
    needed += [cache_path(member) for member in members if member is not None and CACHE_NAME in member.modifiers]
    gone = next((path for path in needed if not path.is_file()), None)
    return f"{gone} is gone: choose the folder it is in as Output and press Load Results, or run the steps again" if gone else ""


def _absolute(path: str) -> Path:
    return Path(bpy.path.abspath(path))
