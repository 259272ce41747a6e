"""The mesh-sequence object: its mesh is filled with the frame that the timeline shows.

Only this preview needs the add-on; results play through `scene.playback`. Showing a frame again is cheap.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from pathlib import Path

import bpy

from ...core.errors import RefMeshError
from ...io.formats import frame_format
from ...io.frame_store import FrameStore
from ...io.preview import PreviewMesh
from ...io.sequence import Sequence, timeline_frame
from ...io.source_colors import SourceColors, read_source_colors
from ..scene.far_origin import offset_of
from ..scene.meshes import fill_mesh
from ..scene.objects import new_member, new_root
from ..scene.paths import absolute_path, is_linked, stored_path
from .source_colors import pictures_folder, plain_source, show_colors

MEGABYTE = 2**20
MEMORY_BUDGET = 512 * MEGABYTE  # until the preferences say otherwise; about 80 frames of 100k vertices


_store = FrameStore(MEMORY_BUDGET)
_colors_with: list[Callable[[Path, Path], SourceColors]] = [read_source_colors]


def set_memory_budget(megabytes: int) -> None:
    """Sets how much memory recently shown frames may take."""
    _store.set_budget(megabytes * MEGABYTE)


def read_files_with(parse: Callable[[Path], PreviewMesh], colors: Callable[[Path, Path], SourceColors] = read_source_colors) -> None:
    """Sets who reads the files of frames and their colors: a process of its own, which they cannot harm."""
    _store.parse, _colors_with[0] = parse, colors


def forget_frames() -> None:
    """Frees the memory of all frames."""
    _store.clear()


def read_frame(path: str | Path, output: str | Path) -> PreviewMesh:
    """The mesh of a frame, from memory, or from the cache in the output folder where it has been read before.

    Raises RefMeshError when it cannot be read.
    """
    return _store.read(Path(path), Path(output))


def new_sequence(
    scene: bpy.types.Scene, sequence: Sequence, first: PreviewMesh, name: str, up_axis: str = "Z", unit: float = 1.0
) -> bpy.types.Object:
    """Collection, root and mesh-sequence object called `name`, showing `first`, the mesh of the first frame.

    The root alone carries axis and unit: data and results stay in the coordinates of the files.
    """
    root = new_root(scene, name, up_axis, unit, first.offset)
    owner = new_member(root, f"{name} source", plain_source(), "source")
    root.refmesh.sequence, owner.refmesh.root = owner, root
    for frame in sequence.frames:
        item = owner.refmesh.frames.add()
        item.name, item.path, item.scene_frame = str(frame.number), stored_path(frame.path), timeline_frame(sequence, frame.number)
    fill_mesh(owner.data, first)
    owner.refmesh.shown = owner.refmesh.frames[0].name
    colors = captured_colors(sequence.frames[0].path)
    owner.refmesh.source_colors = colors is not None
    show_colors(owner, colors)
    return owner


def captured_colors(path: Path) -> SourceColors | None:
    """Colors of a frame; None where it has none, and where they cannot be read: its shape is shown all the same."""
    if frame_format(path).parse_appearance is None:
        return None
    try:
        colors = _store.read_colors(path, lambda file: _colors_with[0](file, pictures_folder()))
    except (RefMeshError, ImportError):
        return None
    return colors if len(colors.materials) else None


def frame_at(owner: bpy.types.Object, scene_frame: int) -> bpy.types.PropertyGroup:
    """The frame of the sequence that is shown at `scene_frame`; where a number is missing, the frame before it is held."""
    frames = owner.refmesh.frames
    starts = [0] * len(frames)
    frames.foreach_get("scene_frame", starts)
    return frames[max(bisect_right(starts, scene_frame) - 1, 0)]


def show_frame(owner: bpy.types.Object, scene_frame: int) -> None:
    """Fills the sequence object with the frame shown at `scene_frame`. One that is linked from another file keeps its mesh.

    Raises RefMeshError when the file cannot be read; the mesh then stays as it was.
    """
    frame = frame_at(owner, scene_frame)
    if frame.name != owner.refmesh.shown and not is_linked(owner):
        mesh = read_frame(absolute_path(owner, frame.path), absolute_path(owner, owner.refmesh.output))
        fill_mesh(owner.data, mesh.about(offset_of(owner.refmesh.root)))
        owner.refmesh.shown = frame.name
        color_frame(owner, absolute_path(owner, frame.path))


def color_frame(owner: bpy.types.Object, path: Path) -> None:
    """Shows the frame in `owner`, of the file `path`, in its colors, or plain, as `owner.refmesh.source_colors` says."""
    show_colors(owner, captured_colors(path) if owner.refmesh.source_colors else None)


def color_shown_frame(owner: bpy.types.Object) -> None:
    """As `color_frame`, for the frame that the object holds now."""
    frame = owner.refmesh.frames.get(owner.refmesh.shown)
    if frame is not None and not is_linked(owner):
        color_frame(owner, absolute_path(owner, frame.path))
