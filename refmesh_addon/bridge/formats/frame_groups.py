"""The deformed frames of an export as arrays, group after group, as they are in the output folder."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.types import TriangleMesh
from ...io.ply import read_surface
from ...io.report import read_report, stored_offset
from ..results.corrections import corrected_positions
from .export import Export
from .files import check_result

if TYPE_CHECKING:
    from ...io.refmesh_stream.writer import FrameGroup


def frame_rate() -> float:
    """Frames per second of the scene."""
    render = bpy.context.scene.render
    return render.fps / render.fps_base


def described(size: int, mbps: float, error: float) -> str:
    """Figures of a file in words.  size : bytes.  mbps : 10^6 bits per second.  error : RMS, share of the diagonal."""
    return f"{size / 1e6:.2g} MB, {mbps:.2g} Mbit/s, RMS error {100 * error:.2g} % of the diagonal"


def diagonal(export: Export) -> float:
    """Of the bounding box of the whole sequence, scene units."""
    return float(read_report(export.results)["bbox_diagonal"])


def frame_groups(export: Export, by_scene_frame: bool, colors: bool = False) -> Iterator[FrameGroup]:
    """The chosen frames of each group, read one group at a time.

    by_scene_frame : whether frames have the numbers of the scene's frames, from which times follow, or those of their files.
    A scene frame that holds the one before it has no frame of its own.  colors : whether the groups have their steady colors.
    """
    from ...io.refmesh_stream.writer import FrameGroup  # late: SciPy comes with it, and may be missing
    from ...io.steady_colors import steady_colors

    numbers = {item.scene_frame: int(item.name) for item in export.owner.refmesh.frames}
    report = read_report(export.results)
    paths = {frame["number"]: export.results / frame["deformed"] for frame in report["frames"]}
    for index, frames in export.choice.groups.items():
        chosen = [frame for frame in frames if frame in numbers]
        if not chosen:
            continue
        for frame in chosen:
            check_result(paths[numbers[frame]])
        meshes = [read_surface(paths[numbers[frame]]) for frame in chosen]
        names = chosen if by_scene_frame else [numbers[frame] for frame in chosen]
        positions = np.stack([shown_vertices(export, index, frame, mesh) for frame, mesh in zip(chosen, meshes)])
        appearance = steady_colors(export.results, report, index, meshes[0]) if colors else None
        yield FrameGroup(tuple(names), positions, meshes[0].triangles, appearance)


def shown_vertices(export: Export, index: int, scene_frame: int, mesh: TriangleMesh) -> np.ndarray:
    """(R, 3) vertices of a deformed frame, with the corrections of its group."""
    corrected = corrected_positions(export.owner, index, scene_frame)
    return mesh.vertices if corrected is None else corrected + stored_offset(read_report(export.results))
