"""Shape keys of an object, as offsets that survive another topology."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

SETTINGS = ("slider_min", "slider_max", "value", "mute", "interpolation", "vertex_group")  # the limits before the value


@dataclass(frozen=True)
class ShapeKey:
    """A shape key.  offsets : (V, 3) from the basis, scene units of the object.  relative_to : name of the key it is relative to."""

    name: str
    offsets: np.ndarray
    relative_to: str
    settings: dict[str, object]


def read_shape_keys(member: bpy.types.Object) -> list[ShapeKey]:
    """All shape keys in their order, the basis first; [] without any."""
    keys = member.data.shape_keys
    if keys is None:
        return []
    basis = _coordinates(keys.reference_key)
    return [
        ShapeKey(key.name, _coordinates(key) - basis, key.relative_key.name, {name: getattr(key, name) for name in SETTINGS})
        for key in keys.key_blocks
    ]


def write_shape_keys(member: bpy.types.Object, keys: list[ShapeKey], rest: np.ndarray) -> None:
    """Replaces the shape keys by these, on a mesh whose basis is `rest`, (V, 3). Keyframes of their values are kept."""
    animation = _animation(member)
    active, pinned = member.active_shape_key_index, member.show_only_shape_key
    clear_shape_keys(member)
    for key in keys:
        block = member.shape_key_add(name=key.name, from_mix=False)
        block.data.foreach_set("co", (rest + key.offsets).astype(np.float32).ravel())
    blocks = member.data.shape_keys.key_blocks if keys else {}
    for key in keys:
        blocks[key.name].relative_key = blocks[key.relative_to]
        for name, value in key.settings.items():
            setattr(blocks[key.name], name, value)
    member.active_shape_key_index, member.show_only_shape_key = active, pinned
    if animation and keys:
        _animate(member.data.shape_keys, *animation)


def clear_shape_keys(member: bpy.types.Object) -> None:
    """Removes all shape keys from the mesh, and from the file.

    Blender counts those of a copied mesh twice, keeps them without a mesh, and reports an error whenever such a file is saved.
    """
    keys = member.data.shape_keys
    if keys is None:
        return
    name = keys.name
    member.shape_key_clear()
    kept = bpy.data.shape_keys.get(name)
    if kept is not None and kept.user == member.data:
        bpy.data.batch_remove([kept])


def shift_shape_keys(mesh: bpy.types.Mesh, offset: np.ndarray) -> None:
    """Adds (V, 3) offsets to every shape key, so that each keeps what it adds to the basis."""
    for key in mesh.shape_keys.key_blocks if mesh.shape_keys else ():
        key.data.foreach_set("co", (_coordinates(key) + offset).astype(np.float32).ravel())


def mixed(member: bpy.types.Object) -> np.ndarray:
    """(V, 3) offsets that the shape keys add to the basis at their present values."""
    keys = {key.name: key for key in read_shape_keys(member)}
    total = np.zeros((len(member.data.vertices), 3))
    if member.show_only_shape_key and member.active_shape_key:
        return total + keys[member.active_shape_key.name].offsets
    weights = read_group_weights(member)
    for key in keys.values():
        if not key.settings["mute"] and key.settings["value"]:
            influence = weights.get(key.settings["vertex_group"], np.ones(len(total)))
            total += key.settings["value"] * influence[:, None] * (key.offsets - keys[key.relative_to].offsets)
    return total


def read_group_weights(member: bpy.types.Object) -> dict[str, np.ndarray]:
    """Name of each vertex group that a shape key uses -> (V,) weights, 0 outside the group."""
    keys = member.data.shape_keys.key_blocks if member.data.shape_keys else ()
    used = {key.vertex_group: member.vertex_groups[key.vertex_group].index for key in keys if key.vertex_group in member.vertex_groups}
    weights = {name: np.zeros(len(member.data.vertices)) for name in used}
    for vertex in member.data.vertices if used else ():
        for element in vertex.groups:
            for name, index in used.items():
                if element.group == index:
                    weights[name][vertex.index] = element.weight
    return weights


def _coordinates(key: bpy.types.ShapeKey) -> np.ndarray:
    flat = np.empty(3 * len(key.data), dtype=np.float32)
    key.data.foreach_get("co", flat)
    return flat.reshape(-1, 3).astype(np.float64)


def _animation(member: bpy.types.Object) -> tuple | None:
    keys = member.data.shape_keys
    data = keys and keys.animation_data
    return (data.action, getattr(data, "action_slot", None)) if data and data.action else None


def _animate(keys: bpy.types.Key, action: bpy.types.Action, slot: object) -> None:
    data = keys.animation_data_create()
    data.action = action
    if slot is not None:
        data.action_slot = slot
