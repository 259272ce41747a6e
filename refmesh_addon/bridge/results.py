"""Shows in the scene what the output folder holds: centers, reference meshes, deformed meshes."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ..core.check import RefMeshError
from ..io.files import read_npz
from ..io.meshes import read_mesh
from ..io.report import read_report
from .centers import show_centers
from .groups import remove_deformed, resize_groups, show_deformed, show_in_turn, show_reference

SIDE_STEP = 1.25  # distance of source, reference and result, in widths of the whole motion: they never overlap


def show_results(owner: bpy.types.Object, folder: Path) -> dict:
    """Makes or refreshes the objects of the sequence object `owner` from the results in `folder`; returns the report.

    Raises RefMeshError, naming the file, when results are missing, broken, or of another sequence.
    """
    report = read_report(folder)
    scene_frames = _scene_frames(owner, report, folder)
    positions = read_npz(folder / "centers.npz")["positions"]
    show_centers(owner, positions[0], folder / report["centers_playback"], scene_frames[report["sequence"]["numbers"][0]])
    _show_groups(owner, folder, report["groups"], scene_frames)
    _arrange(owner, SIDE_STEP * float(np.ptp(positions[..., 0])))
    _note_state(owner, report)
    return report


def _scene_frames(owner: bpy.types.Object, report: dict, folder: Path) -> dict[int, int]:
    known = {int(frame.name): frame.scene_frame for frame in owner.refmesh.frames}
    strangers = [number for number in report["sequence"]["numbers"] if number not in known]
    if strangers:
        raise RefMeshError(
            f"{folder / 'report.json'}: has frame {strangers[0]}, which this sequence has not; choose the results of this sequence"
        )
    return known


def _show_groups(owner: bpy.types.Object, folder: Path, groups: list[dict], scene_frames: dict[int, int]) -> None:
    resize_groups(owner, len(groups))
    for index, group in enumerate(groups):
        owner.refmesh.groups[index].start = scene_frames[group["frames"][0]]
        mesh = read_mesh(folder / group["reference"])
        show_reference(owner, index, mesh)
        if group.get("playback"):
            show_deformed(owner, index, mesh, folder / group["playback"])
    if not all(group.get("playback") for group in groups):
        remove_deformed(owner)
    show_in_turn(owner)


def _arrange(owner: bpy.types.Object, step: float) -> None:
    """Source and its centers, reference and result side by side along the root's x."""
    for group in owner.refmesh.groups:
        for member, column in ((group.reference, 1), (group.deformed, 2)):
            if member is not None:
                member.location = (column * step, 0.0, 0.0)


def _note_state(owner: bpy.types.Object, report: dict) -> None:
    state = owner.refmesh
    measured = {str(frame["number"]): frame["source_to_deformed"]["mean"] for frame in report["frames"] if frame.get("source_to_deformed")}
    for frame in state.frames:
        if frame.name in measured:
            frame.distance = measured[frame.name]
        else:
            frame.property_unset("distance")
    reached = [True, bool(report["groups"]), bool(report["frames"]), bool(measured)]
    stages = ("tracking", "reference", "deformation", "evaluation")
    state.done = {stage for stage, there in zip(stages, reached, strict=True) if there}
