"""Textures in exports: the steady texture as the material of the copies that go out, and pictures beside the file."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...io.files import output_folder
from ...io.report import read_report
from ..results.groups import deformed_material
from ..results.textures import captured_name, steady_name
from ..scene.meshes import has_layout
from .export import Export
from .files import copy_result


def is_textured(owner: bpy.types.Object) -> bool:
    """Whether the results of a sequence have textures."""
    groups = owner.refmesh.groups
    return bool(groups) and all(group.deformed and has_layout(group.deformed.data) for group in groups)


def show_steady(owner: bpy.types.Object, copies: dict[int, bpy.types.Object]) -> None:
    """Gives copies of the deformed meshes, by group, the steady texture of their group, which every program can show.

    Materials of a person stay.
    """
    for index, copy in copies.items():
        material = bpy.data.materials.get(steady_name(owner, index))
        for slot in copy.material_slots if material is not None else ():
            if slot.material is not None and slot.material.name in (captured_name(owner), deformed_material().name):
                slot.material = material


def copy_pictures(export: Export, exported: Path | None = None) -> list[Path]:
    """The texture sequence of the chosen frames and the steady textures of the chosen groups, in a folder beside the exported file.

    exported : folder in which Blender's exporter has put the pictures of materials; what is there already is not copied again.
    """
    report = read_report(export.results)
    numbers = {item.scene_frame: int(item.name) for item in export.owner.refmesh.frames}
    chosen = {numbers[frame] for frames in export.choice.groups.values() for frame in frames if frame in numbers}
    paths = [frame["texture"] for frame in report["frames"] if frame["number"] in chosen and frame.get("texture")]
    steady = [report["groups"][index]["texture"] for index in export.choice.groups if report["groups"][index].get("texture")]
    paths += [path for path in steady if exported is None or not (exported / Path(path).name).is_file()]
    folder = output_folder(export.subfolder(f"{export.name}_textures"))
    return [copy_result(export.results / path, folder / Path(path).name) for path in paths]
