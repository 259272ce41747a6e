"""One material for a whole object, above its own, which stay in their slots."""

from __future__ import annotations

import bpy

NAME = "RefMesh Errors"  # of the modifier


def override_material(member: bpy.types.Object, material: bpy.types.Material) -> None:
    """Adds a modifier, after all others, that gives every face the material."""
    modifier = member.modifiers.get(NAME) or member.modifiers.new(NAME, "NODES")
    if modifier.node_group is None:
        modifier.node_group = _nodes(material)
    member.modifiers.move(list(member.modifiers).index(modifier), len(member.modifiers) - 1)


def remove_override(member: bpy.types.Object) -> None:
    """Removes that modifier, if there is one."""
    modifier = member.modifiers.get(NAME)
    if modifier is not None:
        member.modifiers.remove(modifier)


def _nodes(material: bpy.types.Material) -> bpy.types.GeometryNodeTree:
    name = f"{NAME}: {material.name}"
    if name in bpy.data.node_groups:
        return bpy.data.node_groups[name]
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    source, setter, target = (tree.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeSetMaterial", "NodeGroupOutput"))
    setter.inputs["Material"].default_value = material
    tree.links.new(source.outputs[0], setter.inputs[0])
    tree.links.new(setter.outputs[0], target.inputs[0])
    return tree
