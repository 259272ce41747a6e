"""A compressed stream as objects that play: one Mesh Cache object for each group, shown in its own frames."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import bpy
import numpy as np

from ...core.errors import RefMeshError
from ...core.geometry.storage_offset import storage_offset
from ...core.types import TriangleMesh
from ...io.files import output_folder
from ...io.pc2 import pc2_shape, write_pc2
from ...io.refmesh_stream.writer import FrameGroup
from ..scene.materials import image_material
from ..scene.meshes import fill_mesh, set_uvs
from ..scene.objects import new_member, new_root
from ..scene.playback import play_cache, show_only_between
from .groups import deformed_material
from .textures import load_image


class Stream(Protocol):
    """A .refmesh file.  path : of it.  numbers : of the frames of each group, in the order of the file."""

    path: Path
    numbers: list[tuple[int, ...]]

    def group(self, index: int) -> FrameGroup:
        """Decodes one group. Raises RefMeshError where it is damaged."""


def import_stream(scene: bpy.types.Scene, reader: Stream, folder: Path, up_axis: str) -> bpy.types.Object:
    """Adds the objects below a new root, which is returned; point caches go to the folder. The first frame is scene frame 1.

    Raises RefMeshError for a file that is damaged or cannot be written.
    """
    target, stem = output_folder(folder), reader.path.stem
    starts = [numbers[0] - reader.numbers[0][0] + 1 for numbers in reader.numbers]
    first = reader.group(0)
    offset = storage_offset(first.positions[0].min(axis=0), first.positions[0].max(axis=0))
    root = new_root(scene, stem, up_axis, 1.0, offset)
    for index, start in enumerate(starts):
        group, last = (reader.group(index) if index else first), index + 1 == len(starts)
        member = new_member(root, f"{stem}_group_{index:03d}", deformed_material(), "result")
        fill_mesh(member.data, TriangleMesh(group.positions[0] - offset, group.triangles))
        cache = target / f"{stem}_group_{index:03d}.pc2"
        samples = _with_gaps_held(group)
        _check_replaceable(cache, (len(samples), group.positions.shape[1]))
        write_pc2(cache, (group.positions[sample] for sample in samples), group.positions.shape[1], len(samples), offset)
        _show_texture(member, reader.path, index, len(group.triangles))
        play_cache(member, cache, start)
        show_only_between(member, start if index else None, None if last else starts[index + 1])
    return root


def _show_texture(member: bpy.types.Object, stream: Path, index: int, triangles: int) -> None:
    """The texture that lies beside the stream, where there is one."""
    from ...io.refmesh_stream.textures import read_texture  # late: SciPy comes with it, and may be missing

    texture = read_texture(stream, index, triangles)
    if texture is not None:
        set_uvs(member.data, texture.layout.corners)
        member.data.materials[0] = image_material(f"{member.name} Steady", load_image(texture.picture))


def _check_replaceable(cache: Path, shape: tuple[int, int]) -> None:
    """Raises RefMeshError for a file that an earlier import cannot have written."""
    try:
        own = not cache.exists() or pc2_shape(cache) == shape
    except RefMeshError:
        own = False
    if not own:
        raise RefMeshError(f"{cache}: is another file, which is kept; choose another folder")


def _with_gaps_held(group: FrameGroup) -> np.ndarray:
    """For every number from the first to the last frame of a group, the frame that is shown then: the one before, where one is missing."""
    every = np.arange(group.numbers[0], group.numbers[-1] + 1)
    return np.searchsorted(group.numbers, every, side="right") - 1
