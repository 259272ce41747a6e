"""Groups of frames as markers on the timeline."""

from __future__ import annotations

import bpy

from ...io.frame_range import range_text


def show_markers(owner: bpy.types.Object, groups: list[list[int]]) -> None:
    """A marker where each group begins, named after the frames of the group; replaces those of an earlier run.

    groups : the frame numbers of each group. A marker that the user renamed keeps its name while a group begins there.
    """
    scene, root = owner.users_scene[0], owner.refmesh.root.name
    renamed = {marker.frame: marker.name for marker in markers_of(owner, scene) if _is_renamed(marker, root)}
    remove_markers(owner, scene)
    for group, numbers in zip(owner.refmesh.groups, groups, strict=True):
        name = f"{root} {range_text(numbers[0], numbers[-1])}"
        marker = scene.timeline_markers.new(renamed.get(group.start, name), frame=group.start)
        marker.refmesh_sequence, marker.refmesh_name = owner, name


def _is_renamed(marker: bpy.types.TimelineMarker, root: str) -> bool:
    """Scenes of earlier versions do not have the name that the marker was given: there, one that begins with the root's was given."""
    return marker.name != marker.refmesh_name if marker.refmesh_name else not marker.name.startswith(root)


def markers_of(owner: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.TimelineMarker]:
    """The markers of a sequence in the order of time."""
    own = [marker for marker in scene.timeline_markers if marker.refmesh_sequence == owner]
    return sorted(own, key=lambda marker: marker.frame)


def remove_markers(owner: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Removes the markers of a sequence; markers of the user stay."""
    for marker in markers_of(owner, scene):
        scene.timeline_markers.remove(marker)
