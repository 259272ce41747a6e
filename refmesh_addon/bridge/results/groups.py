"""Reference mesh and deformed mesh of each group of frames; each group is visible in its own frames only."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ...io.pc2 import read_pc2
from ...io.preview import PreviewMesh
from ..scene.attributes import read_attributes
from ..scene.far_origin import RESULTS_OFFSET, offset_of, results_shift
from ..scene.geometry_update import OWN_LAYERS, Shape, update_geometry
from ..scene.materials import DEFORMED_COLOR, REFERENCE_COLOR, plain_material
from ..scene.meshes import UV_NAME
from ..scene.objects import kind_collection, new_member, remove_object
from ..scene.overrides import NAME as OVERRIDE_NAME
from ..scene.playback import CACHE_NAME, show_only_between
from ..scene.visibility_nodes import NAME as VISIBILITY_NAME
from .corrections import play_results
from .own_mesh import adopt_own_mesh

ERROR_LAYER = "RefMesh Error"  # color attribute of the deformed meshes while their errors are shown
COLUMNS = {"source": 0, "centers": 1, "reference": 2, "result": 3}  # of the row side by side


def resize_groups(owner: bpy.types.Object, count: int) -> None:
    """Removes the objects of groups beyond `count` and adds empty groups up to it.

    Objects that a person has worked on are not removed, but hidden in a collection of their own.
    """
    groups = owner.refmesh.groups
    while len(groups) > count:
        for member in (groups[-1].reference, groups[-1].deformed, groups[-1].kept):
            _put_aside(owner, member) if has_work(member) else remove_object(member)
        groups.remove(len(groups) - 1)
    while len(groups) < count:
        groups.add()


def show_reference(owner: bpy.types.Object, index: int, mesh: PreviewMesh) -> str:
    """Creates or updates the reference object of one group. Returns what was carried to another topology."""
    group = owner.refmesh.groups[index]
    if group.reference is None:
        material = plain_material("RefMesh Reference", REFERENCE_COLOR)
        group.reference = _new_group_object(owner, f"reference {index:03d}", material, "reference")
    adopt_own_mesh(owner, group.reference, len(mesh.vertices))
    return update_geometry(group.reference, Shape(mesh))


def show_deformed(owner: bpy.types.Object, index: int, mesh: PreviewMesh, cache: Path) -> str:
    """Creates or updates the deformed object of one group, which plays the PC2 file `cache` on the reference mesh.

    Returns what was carried to another topology.
    """
    group = owner.refmesh.groups[index]
    if group.deformed is None and group.kept is not None:
        _take_back(owner, group)
    if group.deformed is None:
        group.deformed = _new_group_object(owner, f"deformed {index:03d}", deformed_material(), "result")
    adopt_own_mesh(owner, group.deformed, len(mesh.vertices))
    carried = update_geometry(group.deformed, Shape(mesh, next(read_pc2(cache))))
    play_results(owner, index, cache)
    return carried


def deformed_material() -> bpy.types.Material:
    """The material of deformed meshes that show no errors."""
    return plain_material("RefMesh Deformed", DEFORMED_COLOR)


def spans(owner: bpy.types.Object) -> list[tuple[int | None, int | None]]:
    """For each group the scene frame it is shown from and the one it ends before; None before the first and after the last."""
    starts = [group.start for group in owner.refmesh.groups][1:]
    return list(zip([None, *starts], [*starts, None])) if owner.refmesh.groups else []


def show_in_turn(owner: bpy.types.Object, index: int) -> None:
    """Keys the objects of a group so that they are visible in its own frames only."""
    group = owner.refmesh.groups[index]
    for member in (group.reference, group.deformed):
        if member is not None:
            show_only_between(member, *spans(owner)[index])


def arrange(owner: bpy.types.Object) -> None:
    """Source, centers, reference and result side by side along the root's x, or all in one place."""
    state = owner.refmesh
    members = [(state.centers, "centers"), (state.trails, "centers")]
    for group in state.groups:
        members += [(group.reference, "reference"), (group.deformed, "result")]
    for member, kind in members:
        if member is not None:
            place(owner, member, COLUMNS[kind])


def place_results(owner: bpy.types.Object, offset: np.ndarray) -> None:
    """Places results anew where they are stored about another offset, (3,), than those before them."""
    root, before = owner.refmesh.root, results_shift(owner.refmesh.root)
    if not np.array_equal(offset, root.get(RESULTS_OFFSET, offset_of(root))):
        root[RESULTS_OFFSET] = offset.tolist()
    if not np.array_equal(before, results_shift(root)):
        arrange(owner)


def place(owner: bpy.types.Object, member: bpy.types.Object, column: int) -> None:
    """Moves an object to its column of the row, or to the place of the source."""
    state = owner.refmesh
    step = 0.0 if state.arrangement == "OVERLAY" else column * state.side_step
    member.location = results_shift(state.root) + (step, 0.0, 0.0)


def remove_deformed(owner: bpy.types.Object) -> None:
    """Removes deformed objects whose results are no longer there; one that a person has worked on is kept for the next results."""
    for group in owner.refmesh.groups:
        if has_work(group.deformed):
            group.kept = group.deformed
            group.deformed = None
            _put_aside(owner, group.kept)
        else:
            remove_object(group.deformed)


def has_work(member: bpy.types.Object | None) -> bool:
    """Whether an object has more than results: layers, vertex groups, shape keys, modifiers or materials of a person."""
    if member is None:
        return False
    mesh, own = member.data, {UV_NAME, *OWN_LAYERS, ERROR_LAYER}
    layers = [layer for layer in read_attributes(mesh) if layer.name not in own]
    modifiers = [modifier for modifier in member.modifiers if modifier.name not in (CACHE_NAME, OVERRIDE_NAME, VISIBILITY_NAME)]
    return bool(layers or modifiers or len(member.vertex_groups) or mesh.shape_keys or len(member.material_slots) > 1)


def _put_aside(owner: bpy.types.Object, member: bpy.types.Object) -> None:
    kept = kind_collection(owner.refmesh.root, "kept")
    kept.hide_viewport = kept.hide_render = True
    for collection in member.users_collection:
        collection.objects.unlink(member)
    kept.objects.link(member)


def _take_back(owner: bpy.types.Object, group: bpy.types.PropertyGroup) -> None:
    group.deformed, group.kept = group.kept, None
    for collection in group.deformed.users_collection:
        collection.objects.unlink(group.deformed)
    kind_collection(owner.refmesh.root, "result").objects.link(group.deformed)


def _new_group_object(owner: bpy.types.Object, label: str, material: bpy.types.Material, kind: str) -> bpy.types.Object:
    member = new_member(owner.refmesh.root, f"{owner.refmesh.root.name} {label}", material, kind)
    member.refmesh.sequence = owner
    place(owner, member, COLUMNS[kind])
    return member
