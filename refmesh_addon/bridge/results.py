"""Shows in the scene what the output folder holds: centers, reference meshes, deformed meshes."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from zipfile import BadZipFile

import bpy
import numpy as np

from ..core.check import RefMeshError
from ..core.settings import Settings, flat_fields
from ..core.types import TriangleMesh
from ..io.files import read_npz
from ..io.frame_range import parse_ranges, ranges_among
from ..io.meshes import read_mesh
from ..io.report import read_report
from .centers import show_centers
from .groups import remove_deformed, resize_groups, show_deformed, show_in_turn, show_reference
from .playback import check_cache
from .status import used_settings

STAGES = tuple(stage.name for stage in fields(Settings))
SIDE_STEP = 1.25  # distance of source, reference and result, in widths of the whole motion: they never overlap


def show_results(owner: bpy.types.Object, folder: Path) -> None:
    """Makes or refreshes the objects of the sequence object `owner` from the results in `folder`.

    Raises RefMeshError, naming the file, when results are missing, broken, or of another sequence; the scene is as
    before then.
    """
    report = read_report(folder)
    scene_frames = _scene_frames(owner, report, folder)
    positions = _read_positions(folder / "centers.npz")
    centers_cache = folder / report["centers_playback"]
    check_cache(centers_cache, positions.shape[1])
    meshes = _read_references(folder, report["groups"])
    show_centers(owner, positions[0], centers_cache, scene_frames[report["sequence"]["numbers"][0]])
    _show_groups(owner, folder, report["groups"], meshes, scene_frames)
    _arrange(owner, SIDE_STEP * float(np.ptp(positions[..., 0])))
    _note_state(owner, report)


def _scene_frames(owner: bpy.types.Object, report: dict, folder: Path) -> dict[int, int]:
    known = {int(frame.name): frame.scene_frame for frame in owner.refmesh.frames}
    strangers = [number for number in report["sequence"]["numbers"] if number not in known]
    if strangers:
        raise RefMeshError(
            f"{folder / 'report.json'}: has frame {strangers[0]}, which this sequence has not; choose the results of this sequence"
        )
    return known


def _read_positions(path: Path) -> np.ndarray:
    try:
        return read_npz(path)["positions"]
    except (OSError, ValueError, KeyError, BadZipFile) as error:
        raise RefMeshError(f"{path}: cannot be read ({error}); run the steps again") from error


def _read_references(folder: Path, groups: list[dict]) -> list[TriangleMesh]:
    meshes = [read_mesh(folder / group["reference"]) for group in groups]
    for group, mesh in zip(groups, meshes):
        if group.get("playback"):
            check_cache(folder / group["playback"], len(mesh.vertices))
    return meshes


def _show_groups(
    owner: bpy.types.Object, folder: Path, groups: list[dict], meshes: list[TriangleMesh], scene_frames: dict[int, int]
) -> None:
    resize_groups(owner, len(groups))
    for index, (group, mesh) in enumerate(zip(groups, meshes)):
        owner.refmesh.groups[index].start = scene_frames[group["frames"][0]]
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
    known = {setting.name for setting in flat_fields()}
    settings = {name: value for name, value in report["settings"].items() if name in known}
    state.frame_selection = _selection(state, report["sequence"]["numbers"])
    state.results = used_settings(state, report["seconds"], settings)
    state.settings.assign(settings)
    state.done = {stage for stage, there in zip(STAGES, reached, strict=True) if there}


def _selection(state, numbers: list[int]) -> str:
    """The choice of frames that gives these numbers; the one that stands there already where it does."""
    everything = [int(frame.name) for frame in state.frames]
    chosen = parse_ranges(state.frame_selection)
    if numbers == [number for number in everything if not chosen or any(number in item for item in chosen)]:
        return state.frame_selection
    return ",".join(f"{first}-{last}" if last > first else str(first) for first, last in ranges_among(numbers, everything))
