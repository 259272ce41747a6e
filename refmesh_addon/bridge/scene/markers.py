"""Groups of frames as markers on the timeline."""

from __future__ import annotations

import bpy


def show_markers(owner: bpy.types.Object, groups: list[list[int]]) -> None:
    """A marker where each group begins, named after the frames of the group; replaces those of an earlier run.

    groups : the frame numbers of each group. A marker that the user renamed keeps its name while a group begins there.
    """
    scene = owner.users_scene[0]
    named = {marker.frame: marker.name for marker in markers_of(owner, scene)}
    remove_markers(owner, scene)
    for group, numbers in zip(owner.refmesh.groups, groups, strict=True):
        default = f"{owner.refmesh.root.name} {numbers[0]}-{numbers[-1]}"
        name = named.get(group.start, default)
        marker = scene.timeline_markers.new(default if name.startswith(owner.refmesh.root.name) else name, frame=group.start)
        marker.refmesh_sequence = owner


def markers_of(owner: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.TimelineMarker]:
    """The markers of a sequence in the order of time."""
    own = [marker for marker in scene.timeline_markers if marker.refmesh_sequence == owner]
    return sorted(own, key=lambda marker: marker.frame)


def remove_markers(owner: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Removes the markers of a sequence; markers of the user stay."""
    for marker in markers_of(owner, scene):
        scene.timeline_markers.remove(marker)
