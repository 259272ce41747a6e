"""A PLY file for each frame, as in the output folder: with velocities and error colors, or with the capture's vertex colors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ...io.files import output_folder
from ...io.formats import PLY
from ...io.ply import replace_positions
from ...io.report import read_report, stored_offset
from ..results.corrections import corrected_positions
from .export import Export
from .files import copy_result


def write(export: Export) -> list[Path]:
    """A file for each chosen frame, in a folder of their own. A scene frame that holds the one before it has none."""
    folder = output_folder(export.folder / "ply")
    numbers = {item.scene_frame: int(item.name) for item in export.owner.refmesh.frames}
    paths = {frame["number"]: frame.get("colored", frame["deformed"]) for frame in read_report(export.results)["frames"]}
    chosen = [(index, frame) for index, frames in export.choice.groups.items() for frame in frames if numbers.get(frame) in paths]
    return [_write_frame(export, index, frame, export.results / paths[numbers[frame]], folder) for index, frame in chosen]


def _write_frame(export: Export, index: int, scene_frame: int, source: Path, folder: Path) -> Path:
    """A copy of the file; where the group has corrections, with corrected positions in it."""
    target = copy_result(source, export.file(f"{folder.name}/{source.name}"))
    corrected = corrected_positions(export.owner, index, scene_frame)
    if corrected is not None:
        replace_positions(target, corrected + stored_offset(read_report(export.results)))
    return target


FORMAT = replace(PLY, write=write, contents="One PLY for each frame")
