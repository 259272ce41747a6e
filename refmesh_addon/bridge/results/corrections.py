"""Corrections of a deformed mesh: what a person changes in one frame holds over its group, or a range of frames with a fade.

The offsets are an attribute of the mesh, in the rest shape's coordinates, so they survive a run and go along to another topology. What
plays is a point cache of its own, which is written anew when a correction or the results change.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import RefMeshError
from ...core.types import TriangleMesh
from ...io.pc2 import pc2_shape, read_pc2, write_pc2
from ..scene.attributes import Attribute, read_attribute, surface_of, write_attribute
from ..scene.geometry_update import rest_positions
from ..scene.meshes import read_positions, set_positions
from ..scene.paths import absolute_path, stored_path
from ..scene.playback import CACHE_NAME, cache_path, play_cache
from ..scene.shape_keys import mixed, shift_shape_keys

LAYER = "RefMesh Correction"  # start of the names of attributes with offsets
LEAST = 1e-6  # share of the size of the mesh below which a vertex counts as unchanged: rounding of single precision
DIGEST_BYTES = 6


def begin_edit(owner: bpy.types.Object, index: int, scene_frame: int) -> bpy.types.Object:
    """The deformed mesh of a group takes the shape it has in this frame and stops playing, so that it can be edited; returns it."""
    group = owner.refmesh.groups[index]
    if group.is_edited:
        raise RefMeshError(f"group {index} is being edited in frame {group.edited_frame}: apply or discard that first")
    member = group.deformed
    pose = _sample(cache_path(member), group.start, scene_frame)
    _shift(member.data, pose)
    member.modifiers[CACHE_NAME].show_viewport = False
    group.is_edited, group.edited_frame = True, scene_frame
    return member


def discard_edit(owner: bpy.types.Object, index: int) -> None:
    """The deformed mesh plays again, without what was changed on it."""
    group = owner.refmesh.groups[index]
    _play_again(group)


def apply_edit(owner: bpy.types.Object, index: int, scene_frame: int, span: tuple[int, int, int]) -> int:
    """What was changed on the deformed mesh becomes a correction. Returns the number of vertices that it moves.

    Without `begin_edit`, what differs from the reference mesh is the change: moved vertices and shape keys.
    span : first and last scene frame, and the frames over which it fades before and after. Raises RefMeshError for no change.
    """
    from ...core.deformation.corrections import LocalFrames

    group = owner.refmesh.groups[index]
    mesh, rest = group.deformed.data, rest_positions(group.deformed.data).astype(np.float64)
    frame = group.edited_frame if group.is_edited else scene_frame
    base = _sample(cache_path(group.deformed), group.start, frame) if group.is_edited else rest
    offsets = read_positions(mesh).astype(np.float64) - base + mixed(group.deformed)
    chosen = np.flatnonzero(np.linalg.norm(offsets, axis=1) > LEAST * np.abs(rest).max())
    if not len(chosen):
        raise RefMeshError("nothing was changed on the deformed mesh: press Edit Shape, move vertices or sculpt, then Apply Edit")
    local = np.zeros_like(offsets)
    local[chosen] = offsets[chosen]
    if group.is_edited:
        results = _sample(absolute_path(owner, group.cache), group.start, frame)  # without corrections, as when it is played
        local[chosen] = LocalFrames(_rest_mesh(mesh), chosen, _longest(offsets)).to_rest(offsets[chosen], results)
    item = group.corrections.add()
    item.layer = _new_layer(mesh)
    item.name, item.first, item.last, item.fade = f"Frame {frame}", *span
    write_attribute(mesh, Attribute(item.layer, "POINT", "FLOAT_VECTOR", local))
    for key in mesh.shape_keys.key_blocks if mesh.shape_keys else ():
        key.value = 0.0  # it is part of the correction now
    _play_again(group)
    group.active_correction = len(group.corrections) - 1
    replay(owner, index)
    return len(chosen)


def remove_correction(owner: bpy.types.Object, index: int, number: int) -> None:
    """Removes a correction of a group and its offsets."""
    group = owner.refmesh.groups[index]
    layer = group.deformed.data.attributes.get(group.corrections[number].layer)
    if layer is not None:
        group.deformed.data.attributes.remove(layer)
    group.corrections.remove(number)
    group.active_correction = max(0, min(group.active_correction, len(group.corrections) - 1))
    replay(owner, index)


def replay(owner: bpy.types.Object, index: int) -> None:
    """Plays the results of a group with all corrections that are not muted; does nothing where that plays already."""
    group = owner.refmesh.groups[index]
    if group.deformed is not None and group.cache:
        play_cache(group.deformed, _corrected_cache(owner, index), group.start)


def play_results(owner: bpy.types.Object, index: int, cache: Path) -> None:
    """Plays a point cache of the results on a group, with the corrections of the group."""
    group = owner.refmesh.groups[index]
    stored = stored_path(cache)
    if group.cache != stored:
        group.cache = stored
    replay(owner, index)


def active_corrections(group: bpy.types.PropertyGroup) -> list[bpy.types.PropertyGroup]:
    """Those that are not muted and whose offsets are there."""
    layers = group.deformed.data.attributes if group.deformed else {}
    return [item for item in group.corrections if not item.mute and item.layer in layers]


def corrected_positions(owner: bpy.types.Object, index: int, scene_frame: int) -> np.ndarray | None:
    """(V, 3) positions that a group shows in a scene frame; None where the results hold the same, since nothing is corrected."""
    group = owner.refmesh.groups[index]
    return _sample(cache_path(group.deformed), group.start, scene_frame) if active_corrections(group) else None


def _corrected_cache(owner: bpy.types.Object, index: int) -> Path:
    group = owner.refmesh.groups[index]
    source, mesh, items = absolute_path(owner, group.cache), group.deformed.data, active_corrections(group)
    if not items:
        return source
    layers = [read_attribute(mesh.attributes[item.layer]).values for item in items]
    spans = [(item.first, item.last, item.fade) for item in items]
    digest = hashlib.blake2b(json.dumps([source.name, group.start, spans]).encode(), digest_size=DIGEST_BYTES)
    for values in layers:
        digest.update(values.tobytes())
    target = source.with_name(f"corrected_{index:03d}-{digest.hexdigest()}.pc2")
    if not target.is_file():
        samples, points = pc2_shape(source)
        write_pc2(target, _corrected_samples(source, _rest_mesh(mesh), group.start, layers, spans), points, samples)
    return target


def _corrected_samples(source: Path, rest: TriangleMesh, start: int, layers: list[np.ndarray], spans: list[tuple]) -> Iterator[np.ndarray]:
    from ...core.deformation.corrections import LocalFrames, influence

    parts = []
    for values, span in zip(layers, spans):
        chosen = np.flatnonzero(values.any(axis=1))
        offsets = values[chosen].astype(np.float64)
        parts.append((chosen, offsets, LocalFrames(rest, chosen, _longest(offsets)), span))
    for scene_frame, sample in enumerate(read_pc2(source), start):
        corrected = sample.astype(np.float64)
        for chosen, offsets, frames, span in parts:
            share = influence(scene_frame, *span)
            if share > 0:
                corrected[chosen] += share * frames.to_pose(offsets, sample)
        yield corrected


def _longest(offsets: np.ndarray) -> float:
    return float(np.linalg.norm(offsets, axis=1).max(initial=0.0))


def _sample(cache: Path, start: int, scene_frame: int) -> np.ndarray:
    """(V, 3) float32 that a point cache holds for a scene frame; the ends are held."""
    number = min(max(scene_frame - start, 0), pc2_shape(cache)[0] - 1)
    return next(sample for index, sample in enumerate(read_pc2(cache)) if index == number)


def _rest_mesh(mesh: bpy.types.Mesh) -> TriangleMesh:
    return TriangleMesh(rest_positions(mesh), surface_of(mesh)[0].triangles)


def _shift(mesh: bpy.types.Mesh, positions: np.ndarray) -> None:
    """Moves the vertices to (V, 3) positions; shape keys keep what they add."""
    shift_shape_keys(mesh, positions.astype(np.float64) - read_positions(mesh))
    set_positions(mesh, positions)
    mesh.update()


def _play_again(group: bpy.types.PropertyGroup) -> None:
    _shift(group.deformed.data, rest_positions(group.deformed.data))
    group.deformed.modifiers[CACHE_NAME].show_viewport = True
    group.is_edited = False


def _new_layer(mesh: bpy.types.Mesh) -> str:
    return next(name for number in count(1) if (name := f"{LAYER} {number}") not in mesh.attributes)
