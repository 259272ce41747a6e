"""Steady textures beside a stream: a picture and a layout of the decoded triangles for each group, and a JSON that names them.

STEM_textures/ holds group_000.webp, group_000_layout.npz and so on, and textures.json, whose entry i names the files of the i-th run of
frames in the stream. Row t of a layout's `triangles` belongs to triangle t of the decoded meshes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...core.color.layout import Layout
from ...core.color.transfer import transferred_texture
from ...core.errors import RefMeshError
from ...core.types import TriangleMesh
from ..files import atomic_file, output_folder, write_json, write_npz
from ..images import encoded
from ..regular_files import read_json
from ..result_arrays import layout_arrays
from ..small_glb.surface import texture_size
from .reader import StreamReader
from .writer import FrameGroup

INDEX, EXTENSION = "textures.json", ".webp"


@dataclass(frozen=True)
class StreamTexture:
    """picture : path of the texture.  layout : of the triangles of a run of frames."""

    picture: Path
    layout: Layout


def textures_folder(stream: Path) -> Path:
    """The folder beside a stream."""
    return stream.with_name(f"{stream.stem}_textures")


def write_textures(stream: Path, groups: Iterable[FrameGroup], size: int, unwrap: Callable[[TriangleMesh], Layout]) -> list[Path]:
    """Draws the groups' textures on layouts of the triangles that a stream decodes to; returns the files.

    groups : that the stream was written from; those without a texture get none.  size : greatest side, pixels.
    """
    reader, folder, names, written = StreamReader(stream), textures_folder(stream), [], []
    part = 0
    for index, group in enumerate(groups):
        first, parts = part, 0
        while part < len(reader.entries) and reader.entries[part].numbers[0] in group.numbers:
            part, parts = part + 1, parts + 1
        textured = group.appearance is not None and bool(group.appearance.images)
        names += [f"group_{index:03d}" if textured else ""] * parts
        if textured:
            written += _write_group(output_folder(folder), names[-1], reader.group(first), group, size, unwrap)
    if written:
        write_json(folder / INDEX, names)
        written.append(folder / INDEX)
    return written


def _write_group(
    folder: Path, name: str, decoded: FrameGroup, group: FrameGroup, size: int, unwrap: Callable[[TriangleMesh], Layout]
) -> list[Path]:
    assert group.appearance is not None
    row = group.numbers.index(decoded.numbers[0])
    appearance = replace(group.appearance, mesh=TriangleMesh(group.positions[row], group.triangles))
    mesh = TriangleMesh(decoded.positions[0], decoded.triangles)
    layout = unwrap(mesh)
    picture = encoded(transferred_texture(appearance, mesh, layout, texture_size(appearance, size)), EXTENSION)
    paths = [folder / f"{name}{EXTENSION}", folder / f"{name}_layout.npz"]
    with atomic_file(paths[0]) as file:
        file.write(picture)
    write_npz(paths[1], {"uvs": layout.uvs, "triangles": layout.triangles})
    return paths


def read_texture(stream: Path, part: int, triangles: int) -> StreamTexture | None:
    """The texture of a run of frames, by its place in the stream; None where there is none beside it.

    triangles : number of triangles of the run. Raises RefMeshError, naming the file, where one is damaged or of another stream.
    """
    folder = textures_folder(stream)
    if not (folder / INDEX).is_file():
        return None
    try:
        names = read_json(folder / INDEX)
        if not isinstance(names, list) or part >= len(names):
            raise ValueError("the stream has more runs of frames")
        return _read(folder, str(names[part]), triangles) if names[part] else None
    except (OSError, ValueError) as error:
        raise RefMeshError(f"{folder / INDEX}: the textures do not belong to the stream ({error}); export both again") from error


def _read(folder: Path, name: str, count: int) -> StreamTexture:
    if Path(name).name != name:
        raise ValueError(f"'{name}' is in another folder")
    stored = folder / f"{name}_layout.npz"
    try:
        uvs, triangles = layout_arrays(stored)
    except ValueError as error:
        raise ValueError(f"{stored.name} is damaged: {error}") from error
    if len(triangles) != count:
        raise ValueError(f"{stored.name} is of another mesh")
    return StreamTexture(folder / f"{name}{EXTENSION}", Layout(np.asarray(uvs, dtype=np.float64), triangles))
