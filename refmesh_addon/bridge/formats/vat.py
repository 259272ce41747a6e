"""Vertex animation textures for game engines."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.options import option
from ...io.formats import Format
from ..scene.far_origin import place_in_world
from .export import Export
from .frame_groups import frame_rate
from .small_gltf import groups_about_root, layout_maker


@dataclass(frozen=True)
class VatOptions:
    """Options of the format."""

    arrangement: str = option(
        "square",
        "Where vertices and frames are in the textures",
        choices={
            "square": "Sides that are powers of two, and a texture for normals, as OpenVAT's shaders for Unity and Unreal expect them",
            "row": "A row for each frame, normals below the positions, as OpenVAT's shaders for Godot expect them; at most 8192 vertices",
        },
    )
    triangles: int = option(0, "Maximum number of triangles; 0 keeps all", low=0, high=10_000_000)
    texture: int = option(1024, "Maximum side of the color texture, pixels; 0 leaves it out", low=0, high=8192)


def write(export: Export) -> list[Path]:
    """A folder for each group, as each has a mesh of its own."""
    return [path for name, group in _named(export) for path in _write_group(export, name, group)]


def _named(export: Export) -> Iterator[tuple[str, object]]:
    groups = groups_about_root(export, colors=export.options.texture > 0)
    only = len(export.choice.groups) == 1
    for index, group in zip(export.choice.groups, groups, strict=True):
        yield export.name if only else f"{export.name}_group_{index:03d}", group


def _write_group(export: Export, name: str, group) -> list[Path]:
    from ...io.vat.writer import EVERY, VatChoice, write_vat  # late: SciPy comes with it, and may be missing

    options: VatOptions = export.options
    choice = VatChoice(
        options.arrangement,
        options.triangles or EVERY,
        np.array(place_in_world(export.owner.refmesh.root)),
        options.texture,
        layout_maker(export),
    )
    return write_vat(export.subfolder(f"{name}_vat"), name, group, frame_rate(), choice).paths


FORMAT = Format(
    "vat",
    "Vertex Animation Textures",
    (".png",),
    write=write,
    contents="For game engines, as OpenVAT defines them: textures of positions and normals in 16 bits, mesh as GLB, bounds as JSON",
    options=VatOptions,
)
