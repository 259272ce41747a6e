"""Copies of the deformed objects that exist for one export.

Exporters either leave out frames in which an object is hidden and shift the rest (Alembic), or do not support visibility
(glTF), and importers ignore it. So outside its own frames a stand-in is scaled to zero, which all formats can express.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ...io.pc2 import read_pc2
from ..results.groups import spans
from ..scene.animation import key_between
from ..scene.objects import remove_object
from ..scene.playback import cache_path
from .choice import Choice

SHOWN, GONE = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)


@contextmanager
def cached_stand_ins(owner: bpy.types.Object, choice: Choice) -> Iterator[dict[int, bpy.types.Object]]:
    """Stand-ins that move by the Mesh Cache modifier, one for each chosen group, selected alone; for Alembic and USD."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    selected, active = list(bpy.context.selected_objects), layer.objects.active
    root = bpy.data.objects.new(f"{owner.refmesh.root.name}_root", None)
    copies = {index: _copy_of(owner, index, root) for index in choice.groups}
    try:
        root.matrix_world = owner.refmesh.root.matrix_world
        for member in selected:
            member.select_set(False)
        for member in (root, *copies.values()):
            scene.collection.objects.link(member)
            member.select_set(True)
        yield copies
    finally:
        for member in (*copies.values(), root):
            remove_object(member)
        for member in selected:
            member.select_set(True)
        layer.objects.active = active


@contextmanager
def morphing_stand_ins(owner: bpy.types.Object, choice: Choice) -> Iterator[dict[int, bpy.types.Object]]:
    """Stand-ins that move by one shape key for each chosen scene frame, one for each group, selected alone; for glTF."""
    with cached_stand_ins(owner, choice) as copies:
        for index, copy in copies.items():
            _cache_to_shape_keys(copy, owner.refmesh.groups[index].start, choice.groups[index])
        yield copies


def _copy_of(owner: bpy.types.Object, index: int, root: bpy.types.Object) -> bpy.types.Object:
    """At the place of the source, not beside it: files go out in the input's own coordinates."""
    copy = owner.refmesh.groups[index].deformed.copy()
    copy.data = copy.data.copy()
    copy.name = copy.data.name = f"{owner.refmesh.root.name}_group_{index:03d}"
    copy.animation_data_clear()  # the original keeps its action
    copy.parent, copy.location = root, (0.0, 0.0, 0.0)
    copy.hide_viewport = copy.hide_render = False
    key_between(copy, "scale", spans(owner)[index], inside=SHOWN, outside=GONE)
    return copy


def _cache_to_shape_keys(copy: bpy.types.Object, first_scene_frame: int, frames: tuple[int, ...]) -> None:
    """The first chosen frame is the basis that the others are added to; each is full from its own frame on to the next one.

    Frames beyond the samples of the cache hold the last one and need no key.
    """
    samples = dict(enumerate(read_pc2(cache_path(copy)), first_scene_frame))
    frames = tuple(frame for frame in frames if frame in samples) or (max(samples),)
    copy.data.attributes["position"].data.foreach_set("vector", samples[frames[0]].ravel())  # what is written where there is one frame
    for frame, after in zip(frames, (*frames[1:], None), strict=True):
        key = copy.shape_key_add(name=str(frame), from_mix=False)
        key.data.foreach_set("co", samples[frame].ravel())
        if frame != frames[0]:
            key_between(key, "value", (frame, after), inside=1.0, outside=0.0)
    copy.modifiers.clear()
