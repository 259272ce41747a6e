"""Work on what is exported at every change of frame, while one of Blender's exporters goes through the frames."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

import bpy

from ..sequence.raw_sequence import frame_at


@contextmanager
def at_each_frame(owner: bpy.types.Object, frames: Iterable[dict], show: Callable[[dict], None]) -> Iterator[None]:
    """Inside the block `show` is called with the frame that the sequence shows: at once, and at every change of frame.

    frames : of the report, at least those of the sequence. What `show` raises at a change of frame reaches the console only.
    """
    by_number = {frame["number"]: frame for frame in frames}

    def changed(scene: bpy.types.Scene, _depsgraph: object = None) -> None:
        show(by_number[int(frame_at(owner, scene.frame_current).name)])

    changed(bpy.context.scene)
    bpy.app.handlers.frame_change_pre.append(changed)
    try:
        yield
    finally:
        bpy.app.handlers.frame_change_pre.remove(changed)
