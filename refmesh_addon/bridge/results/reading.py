"""Reads what an output folder holds and checks it; changes nothing in Blender, so a thread may do it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.errors import RefMeshError
from ...core.findings import CENTER_ATTRIBUTES
from ...io.frame_range import format_frames
from ...io.ply import read_surface
from ...io.preview import PreviewMesh
from ...io.report import REPORT_NAME, read_report, stored_offset
from ...io.result_arrays import read_centers
from ..scene.playback import check_cache
from .centers import spacing


@dataclass(frozen=True)
class Results:
    """What an output folder holds, read and checked.

    offset : (3,) about which positions and meshes are stored.  positions : (F, C, 3) centers, `spacing` apart.
    attributes : of each center.  meshes : of each group.
    """

    folder: Path
    report: dict
    offset: np.ndarray
    positions: np.ndarray
    spacing: float
    attributes: dict[str, np.ndarray]
    meshes: list[PreviewMesh]


def read_results(folder: Path, known: dict[int, int]) -> Results:
    """Reads the results of a run.

    known : number of each frame of the sequence -> scene frame. Raises RefMeshError, naming the file, when results are missing,
    broken, or of another sequence.
    """
    report = read_report(folder)
    numbers = (*report["sequence"]["numbers"], *(number for group in report["groups"] for number in group["frames"]))
    foreign = [number for number in numbers if number not in known]
    if foreign:
        others = f"{format_frames(foreign, numbers)}, not in this sequence"
        raise RefMeshError(
            f"{folder / REPORT_NAME}: has {others}; press Reload Frames where they were added later, or choose the results of this sequence"
        )
    centers = read_centers(folder)
    offset = stored_offset(report)
    positions = centers["positions"] - offset
    check_cache(centers_playback(folder, report), positions.shape[1])
    center_spacing = report["tracking"].get("center_spacing") or spacing(positions[0])
    attributes = {name: centers[name] for name in CENTER_ATTRIBUTES if name in centers}
    return Results(folder, report, offset, positions, center_spacing, attributes, _read_references(folder, report["groups"], offset))


def centers_playback(folder: Path, report: dict) -> Path:
    """The point cache of the centers. Raises RefMeshError where the report names none."""
    if not report.get("centers_playback"):
        raise RefMeshError(f"{folder / REPORT_NAME}: names no playback of the centers; run the Track step again")
    return folder / report["centers_playback"]


def _read_references(folder: Path, groups: list[dict], offset: np.ndarray) -> list[PreviewMesh]:
    meshes = [PreviewMesh.of(read_surface(folder / group["reference"])).about(offset) for group in groups]
    for group, mesh in zip(groups, meshes):
        if group.get("playback"):
            check_cache(folder / group["playback"], len(mesh.vertices))
    return meshes
