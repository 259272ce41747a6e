"""Reference mesh and deformed mesh of each group of frames; each group is visible in its own frames only."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...io.preview import PreviewMesh
from ..scene.materials import DEFORMED_COLOR, REFERENCE_COLOR, plain_material
from ..scene.meshes import fill_mesh
from ..scene.objects import new_member, remove_object
from ..scene.playback import play_cache, show_only_between


def resize_groups(owner: bpy.types.Object, count: int) -> None:
    """Removes the objects of groups beyond `count` and adds empty groups up to it."""
    groups = owner.refmesh.groups
    while len(groups) > count:
        remove_object(groups[-1].reference)
        remove_object(groups[-1].deformed)
        groups.remove(len(groups) - 1)
    while len(groups) < count:
        groups.add()


def show_reference(owner: bpy.types.Object, index: int, mesh: PreviewMesh) -> None:
    """Creates or updates the reference object of one group."""
    group = owner.refmesh.groups[index]
    if group.reference is None:
        group.reference = _new_group_object(owner, f"reference {index:03d}", plain_material("RefMesh Reference", REFERENCE_COLOR))
    fill_mesh(group.reference.data, mesh)


def show_deformed(owner: bpy.types.Object, index: int, mesh: PreviewMesh, cache: Path) -> None:
    """Creates or updates the deformed object of one group, which plays the PC2 file `cache` on the reference mesh."""
    group = owner.refmesh.groups[index]
    if group.deformed is None:
        group.deformed = _new_group_object(owner, f"deformed {index:03d}", deformed_material())
    fill_mesh(group.deformed.data, mesh)
    play_cache(group.deformed, cache, group.start)


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
    step = 0.0 if state.arrangement == "OVERLAY" else state.side_step
    members = [(state.centers, 1), (state.trails, 1)]
    for group in state.groups:
        members += [(group.reference, 2), (group.deformed, 3)]
    for member, column in members:
        if member is not None:
            member.location = (column * step, 0.0, 0.0)


def remove_deformed(owner: bpy.types.Object) -> None:
    """Removes deformed objects whose results are no longer there."""
    for group in owner.refmesh.groups:
        remove_object(group.deformed)


def _new_group_object(owner: bpy.types.Object, label: str, material: bpy.types.Material) -> bpy.types.Object:
    member = new_member(owner.refmesh.root, f"{owner.refmesh.root.name} {label}", material)
    member.refmesh.sequence = owner
    return member
