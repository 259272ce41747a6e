"""Objects that belong to a sequence: one collection, one root that everything is parented to, pointers instead of names."""

from __future__ import annotations

import math

import bpy

# Input coordinates stay as they are; only the root is rotated so that "up" is Blender's Z.
QUARTER = math.pi / 2
ROOT_ROTATION = {
    "Y": (QUARTER, 0.0, 0.0),
    "Z": (0.0, 0.0, 0.0),
    "X": (0.0, -QUARTER, 0.0),
    "-Y": (-QUARTER, 0.0, 0.0),
    "-Z": (2 * QUARTER, 0.0, 0.0),
    "-X": (0.0, QUARTER, 0.0),
}


def new_root(scene: bpy.types.Scene, name: str, up_axis: str, unit: float) -> bpy.types.Object:
    """A collection called `name` in the scene and the root Empty in it. unit : scene units in one unit of the files."""
    collection = bpy.data.collections.new(name)
    scene.collection.children.link(collection)
    root = bpy.data.objects.new(name, None)
    root.rotation_euler = ROOT_ROTATION[up_axis]
    root.scale = (unit, unit, unit)
    collection.objects.link(root)
    return root


def new_member(root: bpy.types.Object, name: str, material: bpy.types.Material) -> bpy.types.Object:
    """A mesh object without geometry in the root's collection, parented to the root."""
    mesh = bpy.data.meshes.new(name)
    mesh.materials.append(material)
    member = bpy.data.objects.new(name, mesh)
    root.users_collection[0].objects.link(member)
    member.parent = root
    return member


def remove_object(member: bpy.types.Object | None) -> None:
    """Removes an object, with its mesh and its animation where nothing else uses them; does nothing for None."""
    if member is None:
        return
    mesh = member.data
    actions = _actions_of(member) | _actions_of(getattr(mesh, "shape_keys", None))
    bpy.data.objects.remove(member)
    if isinstance(mesh, bpy.types.Mesh) and not mesh.users:
        bpy.data.meshes.remove(mesh)
    _remove_unused(actions)


def clear_animation(target: bpy.types.Object) -> None:
    """Removes all keyframes of an object, and its action where nothing else uses it."""
    actions = _actions_of(target)
    target.animation_data_clear()
    _remove_unused(actions)


def _actions_of(data: bpy.types.ID | None) -> set[bpy.types.Action]:
    """The action of an ID, if any; as a set, since from Blender 5.0 an object and its shape keys share one."""
    animation = data and data.animation_data
    return {animation.action} if animation and animation.action else set()


def _remove_unused(actions: set[bpy.types.Action]) -> None:
    for action in actions:
        if not action.users:
            bpy.data.actions.remove(action)
