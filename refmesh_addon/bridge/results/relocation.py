"""Frames and results that are no longer where a scene remembers them."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...core.errors import RefMeshError
from ...io.discovery import find_sequence
from ...io.frame_range import format_frames
from ...io.report import REPORT_NAME
from ..scene.paths import absolute_path, stored_path
from ..scene.playback import CACHE_NAME, cache_path
from ..sequence.raw_sequence import show_frame
from .missing import missing_files

LEVELS = 3  # folders upward from the .blend in which files are looked for


def find_moved_files(owner: bpy.types.Object) -> None:
    """Corrects the paths of a sequence whose files were moved together with the scene. Those that are found nowhere stay."""
    state, folder = owner.refmesh, Path(bpy.data.filepath).parent
    first = absolute_path(owner, state.frames[0].path)
    moved = None if first.is_file() else moved_file(first, folder)
    if moved:
        _point_at(owner, {frame.name: moved.parent / absolute_path(owner, frame.path).name for frame in state.frames})
        state.source = stored_path(moved)
    output = absolute_path(owner, state.output)
    report = None if (output / REPORT_NAME).is_file() else moved_file(output / REPORT_NAME, folder, least=2)
    if report:
        state.output = stored_path(report.parent)
    for group in state.groups:
        cache = absolute_path(owner, group.cache) if group.cache else None
        moved = moved_file(cache, folder, least=2) if cache and not cache.is_file() else None
        group.cache = stored_path(moved) if moved else group.cache
    for member in (state.centers, *(group.deformed for group in state.groups)):
        if member is not None and CACHE_NAME in member.modifiers and not cache_path(member).is_file():
            cache = moved_file(cache_path(member), folder, least=2)
            if cache:
                member.modifiers[CACHE_NAME].filepath = stored_path(cache)


def moved_file(path: Path, folder: Path, least: int = 1) -> Path | None:
    """Where a file is now, by the longest end of its path that exists in `folder` or a few levels above it; None where nowhere.

    least : parts of its path that must agree.
    """
    parts = path.parts[1:]
    for count in range(len(parts), least - 1, -1):
        for base in (folder, *folder.parents[:LEVELS]):
            candidate = base.joinpath(*parts[-count:])
            if candidate.is_file():
                return candidate
    return None


def relocate_frames(owner: bpy.types.Object, source: Path) -> None:
    """Points a sequence at its frames in another place: any file of it, its folder or a pattern.

    Raises RefMeshError when frames of the sequence are not there; then nothing changes.
    """
    state = owner.refmesh
    first = source / absolute_path(owner, state.frames[0].path).name
    sequence = find_sequence(first if first.is_file() else source, "")
    paths = {str(frame.number): frame.path for frame in sequence.frames}
    absent = [int(frame.name) for frame in state.frames if frame.name not in paths]
    if absent:
        lacking = format_frames(absent, [int(frame.name) for frame in state.frames])
        raise RefMeshError(f"{source}: lacks {lacking} of this sequence; choose the folder of all of its frames")
    _point_at(owner, paths)
    state.source = stored_path(source)
    state.shown = ""
    show_frame(owner, owner.users_scene[0].frame_current)
    state.missing = missing_files(owner)


def frames_are_in(owner: bpy.types.Object, source: Path) -> bool:
    """Whether the frames that the sequence points at are those of `source`, and there."""
    first = absolute_path(owner, owner.refmesh.frames[0].path)
    return first.is_file() and first.parent in (source, source.parent)


def _point_at(owner: bpy.types.Object, paths: dict[str, Path]) -> None:
    for frame in owner.refmesh.frames:
        frame.path = stored_path(paths[frame.name])
