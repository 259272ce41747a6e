"""What a person may add to an object, and a snapshot of all of it to compare."""

from __future__ import annotations

import bpy
import numpy as np

from refmesh_addon.bridge.scene.attributes import read_attributes
from refmesh_addon.bridge.scene.meshes import read_positions


def dress(member: bpy.types.Object) -> None:
    """Two UV maps, vertex groups, materials by face, color attributes, shape keys, modifiers, keyframes, a place of its own."""
    mesh, positions = member.data, read_positions(member.data).astype(np.float64)
    _add_uv(mesh, positions)
    for name, weights in (("head", np.clip(positions[:, 1], 0, 1)), ("all", np.ones(len(positions)))):
        group = member.vertex_groups.new(name=name)
        for index in np.flatnonzero(weights > 0):
            group.add([int(index)], float(weights[index]), "REPLACE")
    for name in ("skin", "cloth"):
        mesh.materials.append(bpy.data.materials.new(f"{name} of {member.name}"))
    mesh.polygons.foreach_set("material_index", (1 + np.arange(len(mesh.polygons)) % 2).astype(np.int32))
    paint = mesh.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    paint.data.foreach_set("color", np.linspace(0, 1, 4 * len(mesh.loops)).astype(np.float32))
    mesh.color_attributes.active_color = paint
    label = mesh.attributes.new("label", "INT", "FACE")
    label.data.foreach_set("value", np.arange(len(mesh.polygons), dtype=np.int32))
    _add_shape_keys(member, positions)
    _add_modifiers(member)
    member.location = (0.25, 0.0, 0.0)
    member.keyframe_insert("rotation_euler", frame=3)
    member["note"] = "mine"


def _add_uv(mesh: bpy.types.Mesh, positions: np.ndarray) -> None:
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    for name, axes in (("UVMap", [0, 1]), ("Light", [1, 2])):
        layer = mesh.uv_layers.new(name=name)
        layer.uv.foreach_set("vector", positions[corners][:, axes].astype(np.float32).ravel())
    mesh.uv_layers.active = mesh.uv_layers["Light"]
    mesh.uv_layers["Light"].active_render = True


def _add_shape_keys(member: bpy.types.Object, positions: np.ndarray) -> None:
    member.shape_key_add(name="Basis")
    key = member.shape_key_add(name="smile", from_mix=False)
    key.data.foreach_set("co", (positions + [0.0, 0.125, 0.0]).astype(np.float32).ravel())
    key.value, key.vertex_group = 0.5, "head"
    key.keyframe_insert("value", frame=4)


def _add_modifiers(member: bpy.types.Object) -> None:
    smooth = member.modifiers.new("mine", "SMOOTH")
    smooth.vertex_group, smooth.factor, smooth.iterations = "head", 0.25, 3
    warp = member.modifiers.new("warp", "UV_PROJECT")
    warp.uv_layer = "UVMap"


def snapshot(member: bpy.types.Object) -> dict:
    """Everything that `dress` adds, and the mesh itself, by value."""
    mesh = member.data
    keys = mesh.shape_keys.key_blocks if mesh.shape_keys else ()
    return {
        "positions": read_positions(mesh).tolist(),
        "attributes": {layer.name: (layer.domain, layer.data_type, layer.values.tolist()) for layer in read_attributes(mesh)},
        "uv": (mesh.uv_layers.active.name if mesh.uv_layers.active else "", [(uv.name, uv.active_render) for uv in mesh.uv_layers]),
        "colors": (mesh.color_attributes.active_color_name, mesh.color_attributes.render_color_index),
        "groups": [group.name for group in member.vertex_groups],
        "weights": [[(item.group, item.weight) for item in vertex.groups] for vertex in mesh.vertices],
        "materials": [slot.material and slot.material.name for slot in member.material_slots],
        "keys": [(key.name, key.value, key.vertex_group, [tuple(point.co) for point in key.data]) for key in keys],
        "key action": mesh.shape_keys.animation_data.action.name if keys and mesh.shape_keys.animation_data else "",
        "modifiers": [_modifier(modifier) for modifier in member.modifiers],
        "place": (tuple(member.location), member.name, member.get("note")),
        "keyframes": [(curve.data_path, [tuple(point.co) for point in curve.keyframe_points]) for curve in curves(member)],
    }


def _modifier(modifier: bpy.types.Modifier) -> dict:
    plain = (bool, int, float, str)
    values = {name: getattr(modifier, name) for name in modifier.bl_rna.properties.keys()}
    return {name: value for name, value in values.items() if isinstance(value, plain) and name not in ("execution_time", "show_expanded")}


def curves(member: bpy.types.Object) -> list:
    """The animation curves of an object, in Blenders with and without slots."""
    data = member.animation_data
    if data is None or data.action is None:
        return []
    if not hasattr(data, "action_slot"):
        return list(data.action.fcurves)
    bags = [strip.channelbag(data.action_slot) for layer in data.action.layers for strip in layer.strips]
    return [curve for bag in bags if bag for curve in bag.fcurves]
