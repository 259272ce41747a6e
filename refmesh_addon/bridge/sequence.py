"""The mesh-sequence object: its mesh is filled with the frame that the timeline shows.

Only this preview needs the add-on; results play through `playback`. The handler calls no operator and is cheap for
frames it has seen.
"""

from __future__ import annotations

import logging
from bisect import bisect_right
from collections import OrderedDict
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from ..core.check import RefMeshError
from ..core.types import TriangleMesh
from ..io.sequence import Sequence, timeline_frame
from .materials import SOURCE_COLOR, plain_material
from .meshes import fill_mesh
from .objects import new_member, new_root

logger = logging.getLogger(__name__)
MEMORY_BUDGET = 512 * 2**20  # bytes of loaded frames; about 100 frames of 100k vertices


class FrameStore:
    """Meshes read lately, least recently used out first."""

    def __init__(self, budget: int):
        self._budget = budget
        self._meshes: OrderedDict[tuple[str, int], TriangleMesh] = OrderedDict()

    def read(self, path: str) -> TriangleMesh:
        """The mesh of a file, from memory if the file has not changed. Raises RefMeshError when it cannot be read."""
        from ..io.meshes import read_mesh

        key = (path, Path(path).stat().st_mtime_ns if Path(path).is_file() else 0)
        if key not in self._meshes:
            self._meshes[key] = read_mesh(path)
        self._meshes.move_to_end(key)
        while self._bytes() > self._budget and len(self._meshes) > 1:
            self._meshes.popitem(last=False)
        return self._meshes[key]

    def clear(self) -> None:
        """Forgets all meshes."""
        self._meshes.clear()

    def _bytes(self) -> int:
        return sum(mesh.vertices.nbytes + mesh.triangles.nbytes for mesh in self._meshes.values())


_store = FrameStore(MEMORY_BUDGET)
_warned: set[str] = set()


def read_frame(path: str | Path) -> TriangleMesh:
    """The mesh of a frame, from memory where it was read lately. Raises RefMeshError when it cannot be read."""
    return _store.read(str(path))


def new_sequence(scene: bpy.types.Scene, sequence: Sequence, first: TriangleMesh, name: str, up_axis: str) -> bpy.types.Object:
    """Collection, root and mesh-sequence object called `name`, showing `first`, the mesh of the first frame."""
    root = new_root(scene, name, up_axis)
    owner = new_member(root, f"{name} source", plain_material("RefMesh Source", SOURCE_COLOR))
    root.refmesh.sequence, owner.refmesh.root = owner, root
    for frame in sequence.frames:
        item = owner.refmesh.frames.add()
        item.name, item.path, item.scene_frame = str(frame.number), str(frame.path), timeline_frame(sequence, frame.number)
    fill_mesh(owner.data, first)
    owner.refmesh.shown = owner.refmesh.frames[0].name
    return owner


def frame_at(owner: bpy.types.Object, scene_frame: int) -> bpy.types.PropertyGroup:
    """The frame of the sequence that is shown at `scene_frame`; a missing number holds the frame before it."""
    frames = owner.refmesh.frames
    starts = [0] * len(frames)
    frames.foreach_get("scene_frame", starts)
    return frames[max(bisect_right(starts, scene_frame) - 1, 0)]


def show_frame(owner: bpy.types.Object, scene_frame: int) -> None:
    """Fills the sequence object with the frame shown at `scene_frame`.

    Raises RefMeshError when the file cannot be read; the mesh stays as it was then.
    """
    frame = frame_at(owner, scene_frame)
    if frame.name != owner.refmesh.shown:
        fill_mesh(owner.data, read_frame(bpy.path.abspath(frame.path)))
        owner.refmesh.shown = frame.name


@persistent
def show_scene_frame(scene: bpy.types.Scene, depsgraph=None) -> None:
    """Frame-change handler: every sequence of the scene shows its frame; a file that fails is reported once."""
    for candidate in scene.objects:
        if candidate.refmesh.frames and candidate.library is None:
            try:
                show_frame(candidate, scene.frame_current)
            except RefMeshError as error:
                if str(error) not in _warned:
                    _warned.add(str(error))
                    logger.warning("%s", error)


def register():
    bpy.app.handlers.frame_change_post.append(show_scene_frame)


def unregister():
    bpy.app.handlers.frame_change_post.remove(show_scene_frame)
    _store.clear()
    _warned.clear()
