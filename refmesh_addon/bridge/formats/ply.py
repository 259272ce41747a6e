"""A PLY file for each frame, as in the output folder: with velocities and error colors, or with the capture's vertex colors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ...io.files import output_folder
from ...io.formats import PLY
from ...io.report import read_report
from .export import Export
from .files import copy_result


def write(export: Export) -> list[Path]:
    """A file for each chosen frame, in a folder of their own. A scene frame that holds the one before it has none."""
    folder = output_folder(export.folder / "ply")
    numbers = {item.scene_frame: int(item.name) for item in export.owner.refmesh.frames}
    chosen = {numbers[frame] for frames in export.choice.groups.values() for frame in frames if frame in numbers}
    paths = [frame.get("colored", frame["deformed"]) for frame in read_report(export.results)["frames"] if frame["number"] in chosen]
    return [copy_result(export.results / path, folder / Path(path).name) for path in paths]


FORMAT = replace(PLY, write=write, contents="One PLY for each frame")
