"""Copies of the deformed objects that exist for one export.

Exporters either leave out frames in which an object is hidden and shift the rest (Alembic), or do not support visibility
(glTF), and importers ignore it. So outside its own frames a stand-in is scaled to zero, which all formats can express.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from ...core.errors import RefMeshError
from ...io.pc2 import read_pc2
from ..results.corrections import LAYER as CORRECTION
from ..results.groups import spans
from ..results.heat_map import ATTRIBUTE as ERROR_LAYER
from ..scene.animation import keep_only_modifiers, key_between, key_peak, make_linear
from ..scene.far_origin import results_in_world
from ..scene.geometry_update import OWN_LAYERS
from ..scene.meshes import read_positions, set_positions
from ..scene.objects import remove_object
from ..scene.overrides import remove_override
from ..scene.playback import CACHE_NAME, cache_path
from ..scene.shape_keys import clear_shape_keys
from ..scene.visibility_nodes import NAME as VISIBILITY_NAME
from ..scene.visibility_nodes import remove_visibility, show_all
from .export import Export

SHOWN, GONE = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)


@contextmanager
def cached_stand_ins(export: Export) -> Iterator[dict[int, bpy.types.Object]]:
    """Stand-ins that move by the Mesh Cache modifier, one for each chosen group, selected alone; for Alembic and USD."""
    owner = export.owner
    scene, layer = bpy.context.scene, bpy.context.view_layer
    selected, active = list(bpy.context.selected_objects), layer.objects.active
    root = bpy.data.objects.new(f"{owner.refmesh.root.name}_root", None)
    copies = {index: _copy_of(export, index, root) for index in export.choice.groups}
    try:
        root.matrix_world = results_in_world(owner.refmesh.root)
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
def morphing_stand_ins(export: Export, blended: bool = False) -> Iterator[dict[int, bpy.types.Object]]:
    """Stand-ins that move by one shape key for each chosen scene frame, one for each group, selected alone; for glTF and FBX.

    blended : whether a chosen frame turns into the next over the frames between them, or is held up to it.
    """
    with cached_stand_ins(export) as copies:
        for index, copy in copies.items():
            frames = export.choice.groups[index]
            remove_visibility(copy)  # morph targets hold no attributes, and no vertices that come and go
            if len(copy.modifiers) > 1:
                samples = evaluated_samples(copy, frames)
            else:
                frames, samples = _cache_samples(copy, export.owner.refmesh.groups[index].start, frames)
            _samples_to_shape_keys(copy, samples, frames, blended)
        yield copies


def _copy_of(export: Export, index: int, root: bpy.types.Object) -> bpy.types.Object:
    """At the place of the source, not beside it: files go out in the input's own coordinates."""
    owner = export.owner
    copy = owner.refmesh.groups[index].deformed.copy()
    copy.data = copy.data.copy()
    copy.name = copy.data.name = f"{owner.refmesh.root.name}_group_{index:03d}"
    keep_only_modifiers(copy)
    copy.parent, copy.location = root, (0.0, 0.0, 0.0)
    copy.hide_viewport = copy.hide_render = False
    _leave_out_own(copy, export.apply_modifiers)
    key_between(copy, "scale", spans(owner)[index], inside=SHOWN, outside=GONE)
    return copy


def _leave_out_own(copy: bpy.types.Object, apply_modifiers: bool) -> None:
    """Takes off what only serves the view or an update, shape keys, which the cache overrides, and modifiers that are not requested."""
    remove_override(copy)
    clear_shape_keys(copy)
    own = [layer.name for layer in copy.data.attributes if layer.name in (*OWN_LAYERS, ERROR_LAYER) or layer.name.startswith(CORRECTION)]
    for name in own:
        copy.data.attributes.remove(copy.data.attributes[name])
    for modifier in [] if apply_modifiers else list(copy.modifiers):
        if modifier.name not in (CACHE_NAME, VISIBILITY_NAME):
            copy.modifiers.remove(modifier)
    show_all(copy)  # one topology in all frames; the attribute says what is hidden


def _cache_samples(copy: bpy.types.Object, start: int, frames: tuple[int, ...]) -> tuple[tuple[int, ...], dict[int, np.ndarray]]:
    """Those of the frames that need a shape key, and positions; frames beyond the samples of the cache hold the last one.

    start : scene frame of the first sample.
    """
    samples = dict(enumerate(read_pc2(cache_path(copy)), start))
    return tuple(frame for frame in frames if frame in samples) or (max(samples),), samples


def _samples_to_shape_keys(copy: bpy.types.Object, samples: dict[int, np.ndarray], frames: tuple[int, ...], blended: bool) -> None:
    """The first chosen frame is the basis that the others are added to; each is full from its own frame on, or in it where blended."""
    set_positions(copy.data, samples[frames[0]])  # what is written where there is one frame
    for before, frame, after in zip((None, *frames), frames, (*frames[1:], None)):
        key = copy.shape_key_add(name=str(frame), from_mix=False)
        key.data.foreach_set("co", samples[frame].ravel())
        if before is None:
            continue
        if blended:
            key_peak(key, "value", (before, after), at=frame)
        else:
            key_between(key, "value", (frame, after), inside=1.0, outside=0.0)
    if blended:
        make_linear(copy.data.shape_keys)
    copy.modifiers.clear()


def evaluated_samples(copy: bpy.types.Object, frames: tuple[int, ...]) -> dict[int, np.ndarray]:
    """(V, 3) positions with all modifiers in each scene frame; the mesh of the copy becomes that of the first one.

    Raises RefMeshError when the modifiers change the number of vertices from frame to frame, which morph targets cannot hold.
    """
    scene, before, samples = bpy.context.scene, bpy.context.scene.frame_current, {}
    try:
        for frame in frames:
            scene.frame_set(frame)
            graph = bpy.context.evaluated_depsgraph_get()
            evaluated = copy.evaluated_get(graph)
            samples[frame] = read_positions(evaluated.data)
            if frame == frames[0]:
                first = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=graph)
    finally:
        scene.frame_set(before)
    if len({len(sample) for sample in samples.values()}) > 1:
        raise RefMeshError(f"{copy.name}: its modifiers change the number of vertices between frames; export without Apply Modifiers")
    replaced, name = copy.data, copy.data.name
    copy.data = first
    bpy.data.meshes.remove(replaced)
    first.name = name
    return samples
