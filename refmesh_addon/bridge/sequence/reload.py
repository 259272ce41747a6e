"""The frames of a sequence as they are on disk now: those that have come since the import, without those that are gone."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path

import bpy

from ...core.errors import RefMeshError
from ...io.discovery import find_sequence
from ...io.frame_range import FrameRange, parse_ranges
from ...io.sequence import Frame, Sequence, timeline_frame
from ..scene.paths import absolute_path, stored_path
from .raw_sequence import show_frame

KEPT = ("distance", "overstretched", "bad")  # of a frame that stays: what the last run found


@dataclass(frozen=True)
class ReloadedFrames:
    """added, removed : numbers.  moved : whether frames that stay are shown at other scene frames now, as after a new first frame
    of a sequence that counts in steps; results in the scene follow with the next run.
    """

    added: tuple[int, ...]
    removed: tuple[int, ...]
    moved: bool

    @property
    def changed(self) -> bool:
        """Whether frames have come or gone."""
        return bool(self.added or self.removed)


def reload_frames(owner: bpy.types.Object) -> ReloadedFrames:
    """Looks for the frames of a sequence anew and shows the current one as it is now; a timeline that fitted the sequence fits it again.

    Those in the list, and those that the field Frames selects: all where it is empty. Raises RefMeshError when none of them is there.
    """
    state = owner.refmesh
    before = {int(frame.name): _values(frame) for frame in state.frames}
    sequence = _on_disk(owner, before.keys())
    spans = [scene for scene in owner.users_scene if (scene.frame_start, scene.frame_end) == _span(state)]
    _list(state, sequence, before)
    for scene in spans:
        scene.frame_start, scene.frame_end = _span(state)
    state.shown = ""
    show_frame(owner, owner.users_scene[0].frame_current)
    numbers = sequence.numbers
    return ReloadedFrames(
        tuple(number for number in numbers if number not in before),
        tuple(number for number in before if number not in numbers),
        any(timeline_frame(sequence, number) != before[number]["scene_frame"] for number in numbers if number in before),
    )


def selected_numbers(state) -> list[int]:
    """Numbers of the frames in the list that the field Frames selects."""
    ranges = parse_ranges(state.frame_selection)
    return [number for number in (int(frame.name) for frame in state.frames) if _is_in(number, ranges)]


def _on_disk(owner: bpy.types.Object, listed: Collection[int]) -> Sequence:
    source, ranges = _source(owner), parse_ranges(owner.refmesh.frame_selection)
    sequence = find_sequence(source)
    frames = tuple(frame for frame in sequence.frames if frame.number in listed or _is_in(frame.number, ranges))
    if not frames:
        raise RefMeshError(f"{source}: has none of the frames of this sequence; choose their folder as Source")
    return replace(sequence, frames=frames)


def _source(owner: bpy.types.Object) -> Path:
    """The path of the field Source; where that was one frame, which is gone, the first frame of the list that is there."""
    state = owner.refmesh
    paths = [absolute_path(owner, path) for path in (state.source, *(frame.path for frame in state.frames))]
    return paths[0] if paths[0].exists() else next((path for path in paths if path.is_file()), paths[0])


def _is_in(number: int, ranges: tuple[FrameRange, ...]) -> bool:
    return not ranges or any(number in item for item in ranges)


def _span(state) -> tuple[int, int]:
    return state.frames[0].scene_frame, state.frames[-1].scene_frame


def _values(frame: bpy.types.PropertyGroup) -> dict[str, object]:
    """What is known of a frame; nothing of what was never set."""
    return {"scene_frame": frame.scene_frame, **{name: getattr(frame, name) for name in KEPT if frame.is_property_set(name)}}


def _list(state, sequence: Sequence, before: dict[int, dict[str, object]]) -> None:
    state.frames.clear()
    for frame in sequence.frames:
        _add(state, sequence, frame, before.get(frame.number, {}))


def _add(state, sequence: Sequence, frame: Frame, known: dict[str, object]) -> None:
    item = state.frames.add()
    for name in KEPT:
        if name in known:
            setattr(item, name, known[name])
    item.name, item.path, item.scene_frame = str(frame.number), stored_path(frame.path), timeline_frame(sequence, frame.number)
