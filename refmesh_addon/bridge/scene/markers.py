"""Groups of frames as markers on the timeline."""

from __future__ import annotations

import bpy


def show_markers(owner: bpy.types.Object, groups: list[list[int]]) -> None:
    """A marker where each group begins, named after the frames of the group; those of an earlier run go.

    groups : the frame numbers of each group. One that a person renamed keeps its name for as long as its place.
    """
    scene = owner.users_scene[0]
    named = {marker.frame: marker.name for marker in markers_of(owner, scene)}
    remove_markers(owner, scene)
    for group, numbers in zip(owner.refmesh.groups, groups, strict=True):
        usual = f"{owner.refmesh.root.name} {numbers[0]}-{numbers[-1]}"
        kept = named.get(group.start, usual)
        marker = scene.timeline_markers.new(usual if kept.startswith(owner.refmesh.root.name) else kept, frame=group.start)
        marker.refmesh_sequence = owner


def markers_of(owner: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.TimelineMarker]:
    """The markers of a sequence by time."""
    found = [marker for marker in scene.timeline_markers if marker.refmesh_sequence == owner]
    return sorted(found, key=lambda marker: marker.frame)


def remove_markers(owner: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Removes the markers of a sequence; those that a person set stay."""
    for marker in markers_of(owner, scene):
        scene.timeline_markers.remove(marker)
