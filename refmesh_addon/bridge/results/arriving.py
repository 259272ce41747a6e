"""A group of frames that a running job has finished, shown while the job goes on with the others."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...io.ply import read_surface
from ...io.preview import PreviewMesh
from ...io.report import read_report, stored_offset
from ..scene.playback import check_cache
from .groups import place_results, resize_groups, show_deformed, show_in_turn, show_reference
from .visibility import switch_kinds


@dataclass(frozen=True)
class ArrivedGroup:
    """index : of the group.  starts : number of the frame that begins each group of the job.  playback : PC2 file.
    offset : (3,) about which both are stored.
    """

    index: int
    starts: tuple[int, ...]
    mesh: PreviewMesh
    playback: Path
    offset: np.ndarray


def read_group(folder: Path, index: int) -> ArrivedGroup:
    """Reads one group from the output folder of a job; touches no Blender data, so that a thread may do it.

    Raises RefMeshError, naming the file, when it cannot be read.
    """
    report = read_report(folder)
    groups, offset = report["groups"], stored_offset(report)
    mesh = PreviewMesh.of(read_surface(folder / groups[index]["reference"])).about(offset)
    playback = folder / groups[index]["playback"]
    check_cache(playback, len(mesh.vertices))
    return ArrivedGroup(index, tuple(group["frames"][0] for group in groups), mesh, playback, offset)


def show_group(owner: bpy.types.Object, arrived: ArrivedGroup) -> str:
    """Creates or updates the objects of one group. Returns what to tell where anything was carried to another topology."""
    state = owner.refmesh
    place_results(owner, arrived.offset)
    had_references = any(group.reference for group in state.groups)
    resize_groups(owner, len(arrived.starts))
    for group, number in zip(state.groups, arrived.starts, strict=True):
        group.start = state.frames[str(number)].scene_frame
    kinds = show_reference(owner, arrived.index, arrived.mesh)
    kinds = show_deformed(owner, arrived.index, arrived.mesh, arrived.playback) or kinds
    show_in_turn(owner, arrived.index)
    state.show_result, state.show_reference = True, state.show_reference and had_references
    switch_kinds(owner)
    for scene in owner.users_scene:
        scene.frame_set(scene.frame_current)  # evaluates the new keyframes
    return f"the topology of group {arrived.index} has changed: carried over by nearest surface were {kinds}" if kinds else ""
