"""Copies of the deformed objects made for one export and removed after it.

Exporters either leave out frames in which an object is hidden, and shift the rest (Alembic), or know no visibility
(glTF), and importers ignore it. So outside its own frames a stand-in is scaled to nothing, which all of them carry.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ..io.pc2 import pc2_shape, read_pc2
from .groups import spans
from .objects import remove_object
from .playback import cache_path, key_between

SHOWN, GONE = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)


@contextmanager
def cached_stand_ins(owner: bpy.types.Object) -> Iterator[list[bpy.types.Object]]:
    """Stand-ins that move by the Mesh Cache modifier, one for each group, selected alone; for Alembic and USD."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    selected, active = list(bpy.context.selected_objects), layer.objects.active
    root = bpy.data.objects.new(f"{owner.refmesh.root.name}_root", None)
    copies = [_copy_of(owner, index, root) for index in range(len(owner.refmesh.groups))]
    try:
        root.matrix_world = owner.refmesh.root.matrix_world
        for member in selected:
            member.select_set(False)
        for member in (root, *copies):
            scene.collection.objects.link(member)
            member.select_set(True)
        yield copies
    finally:
        for member in (*copies, root):
            remove_object(member)
        for member in selected:
            member.select_set(True)
        layer.objects.active = active


@contextmanager
def morphing_stand_ins(owner: bpy.types.Object) -> Iterator[list[bpy.types.Object]]:
    """Stand-ins that move by one shape key for each scene frame, one for each group, selected alone; for glTF."""
    with cached_stand_ins(owner) as copies:
        for copy, group in zip(copies, owner.refmesh.groups, strict=True):
            _cache_to_shape_keys(copy, group.start)
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


def _cache_to_shape_keys(copy: bpy.types.Object, first_scene_frame: int) -> None:
    """The first sample is the basis that the others are added to; each is full at its own frame and the last one is held."""
    cache = cache_path(copy)
    count, _ = pc2_shape(cache)
    for sample, positions in enumerate(read_pc2(cache)):
        scene_frame = first_scene_frame + sample
        key = copy.shape_key_add(name=str(scene_frame), from_mix=False)
        key.data.foreach_set("co", positions.ravel())
        if sample > 0:
            key_between(key, "value", (scene_frame, scene_frame + 1 if sample < count - 1 else None), inside=1.0, outside=0.0)
    copy.modifiers.clear()
