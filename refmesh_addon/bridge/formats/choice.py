"""Which groups and which scene frames of a sequence are exported."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ...core.errors import RefMeshError
from ..results.groups import spans
from ..results.restoring import fits_cache


@dataclass(frozen=True)
class Choice:
    """groups : index of each group -> its chosen scene frames, at least one.  first, last, step : of the scene frames."""

    groups: dict[int, tuple[int, ...]]
    first: int
    last: int
    step: int


def chosen_range(owner: bpy.types.Object, first: int, last: int, step: int) -> range:
    """The scene frames from `first` to `last`, 0 for those of the sequence. Raises RefMeshError when there are none."""
    frames = owner.refmesh.frames
    start, end = frames[0].scene_frame, frames[-1].scene_frame
    first, last = max(first, start) if first else start, min(last, end) if last else end
    if first > last:
        raise RefMeshError(f"no frames to export from {first} to {last}: the sequence has {start} to {end}; choose frames within that")
    return range(first, last + 1, step)


def choose(owner: bpy.types.Object, first: int, last: int, step: int, member: bpy.types.Object | None = None) -> Choice:
    """The scene frames from `first` to `last`, 0 for those of the sequence, that a group has; of the group of `member` alone if given.

    Raises RefMeshError when nothing is left.
    """
    state = owner.refmesh
    if not state.groups or not all(group.deformed for group in state.groups):
        raise RefMeshError(f"{state.root.name}: no deformed meshes to export; run the Deform step first")
    chosen = chosen_range(owner, first, last, step)
    groups = {}
    for index, (low, high) in enumerate(spans(owner)):
        within = [frame for frame in chosen if (low is None or frame >= low) and (high is None or frame < high)]
        if within and (member is None or member in (state.groups[index].deformed, state.groups[index].reference)):
            groups[index] = tuple(within)
    for index in groups:
        _check_fits(state.groups[index].deformed)
    if not groups:
        raise RefMeshError("no group of frames to export: select the deformed mesh of one, or choose other frames")
    return Choice(groups, chosen.start, chosen.stop - 1, step)


def _check_fits(member: bpy.types.Object) -> None:
    """Raises RefMeshError for a mesh that is not the one that the results move, so that formats would differ in what they hold."""
    if not fits_cache(member):
        advice = "press Load Results to get it back; to change the topology, use modifiers above the cache"
        raise RefMeshError(f"{member.name}: its mesh is no longer that of its point cache, so it does not play; {advice}")
