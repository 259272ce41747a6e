"""Objects that belong to a sequence: one collection, one root that everything is parented to, pointers instead of names."""

from __future__ import annotations

import math

import bpy
import numpy as np

from .far_origin import carry_offset

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


KIND = "refmesh_kind"  # custom property of a collection that holds one kind of objects
KINDS = ("source", "centers", "reference", "result")


def new_root(scene: bpy.types.Scene, name: str, up_axis: str, unit: float, offset: np.ndarray) -> bpy.types.Object:
    """A collection called `name` in the scene and the root Empty in it.

    unit : scene units in one unit of the files.  offset : (3,) about which data far from the origin is stored; zeros near it.
    """
    collection = bpy.data.collections.new(name)
    scene.collection.children.link(collection)
    root = bpy.data.objects.new(name, None)
    root.rotation_euler = ROOT_ROTATION[up_axis]
    root.scale = (unit, unit, unit)
    collection.objects.link(root)
    carry_offset(root, offset)
    return root


def kind_collection(root: bpy.types.Object, kind: str) -> bpy.types.Collection:
    """The collection of one of KINDS beside the root; it is created where there is none yet."""
    parent = root.users_collection[0]
    existing = next((child for child in parent.children_recursive if child.get(KIND) == kind), None)
    if existing is not None:
        return existing
    collection = bpy.data.collections.new(f"{root.name} {kind}")
    collection[KIND] = kind
    parent.children.link(collection)
    return collection


def move_to_kind(member: bpy.types.Object, root: bpy.types.Object, kind: str) -> None:
    """Moves an object that is beside the root, as in scenes of earlier versions, to the collection of its kind."""
    parent = root.users_collection[0]
    if member.name in parent.objects:
        kind_collection(root, kind).objects.link(member)
        parent.objects.unlink(member)


def new_member(root: bpy.types.Object, name: str, material: bpy.types.Material, kind: str) -> bpy.types.Object:
    """A mesh object without geometry in the collection of its kind, parented to the root."""
    mesh = bpy.data.meshes.new(name)
    mesh.materials.append(material)
    member = bpy.data.objects.new(name, mesh)
    kind_collection(root, kind).objects.link(member)
    member.parent = root
    member.color = material.diffuse_color  # in solid views that show attributes, where the mesh has none
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


def _actions_of(data: bpy.types.ID | None) -> set[bpy.types.Action]:
    """The action of an ID, if any; as a set, since from Blender 5.0 an object and its shape keys share one."""
    animation = data and data.animation_data
    return {animation.action} if animation and animation.action else set()


def _remove_unused(actions: set[bpy.types.Action]) -> None:
    for action in actions:
        if not action.users:
            bpy.data.actions.remove(action)
