"""The scene as a whole: timeline, clipping of the views, emptying, saving."""

from __future__ import annotations

import errno
import math
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from ...core.errors import RefMeshError
from ...io.files import PARTIAL_SUFFIX

# Clipping of a 3D view, in sizes of the sequence: bounds of its start, least end.
CLIP_START, CLIP_END = (1e-3, 1e-2), 20.0
SAME_RATE = 1e-5  # relative difference of frame rates that is rounding of a Blender property
LAST_BLOCK, TAIL = b"ENDB", 64  # what an uncompressed .blend ends with, in its last bytes
TEXTURE_MARK = "refmesh_texture"  # custom property of images that belong to results


def set_timeline(scene: bpy.types.Scene, first: int, last: int, fps: float = 0.0) -> None:
    """Sets the frame range, shows its first frame, and sets the frame rate unless it is 0."""
    scene.frame_start, scene.frame_end = first, last
    if fps > 0 and not math.isclose(fps, scene.render.fps / scene.render.fps_base, rel_tol=SAME_RATE):
        # Blender holds 29.97 as 30 frames in 1.001 seconds.
        scene.render.fps = max(1, round(fps))
        scene.render.fps_base = scene.render.fps / fps
    scene.frame_set(first)


def widen_clipping(size: float) -> None:
    """Widens the clipping of the 3D views to an object of this size: a capture in millimeters would be clipped.

    size : longest side, scene units.
    """
    spaces = (space for screen in bpy.data.screens for area in screen.areas for space in area.spaces if space.type == "VIEW_3D")
    for space in spaces:
        space.clip_start = min(max(space.clip_start, CLIP_START[0] * size), CLIP_START[1] * size)
        space.clip_end = max(space.clip_end, CLIP_END * size)


@contextmanager
def timeline(scene: bpy.types.Scene, first: int, last: int) -> Iterator[None]:
    """Sets the frame range inside the block; restores range and current frame afterward."""
    before = scene.frame_start, scene.frame_end, scene.frame_current
    # Blender keeps start <= end, so the start is first moved out of the way.
    scene.frame_start, scene.frame_end = first, last
    try:
        yield
    finally:
        scene.frame_start, scene.frame_end = before[:2]
        scene.frame_set(before[2])


def empty_scene() -> None:
    """Removes all objects and collections, and all data that only they used."""
    for kind in (bpy.data.objects, bpy.data.collections):
        bpy.data.batch_remove(list(kind))
    bpy.data.orphans_purge(do_recursive=True)


def save_scene(path: Path) -> None:
    """Saves the .blend. As with File > Save, paths are relative to it then, so that the folder can be moved.

    Raises RefMeshError, naming the file, when it cannot be written.
    """
    filepaths = bpy.context.preferences.filepaths
    versions, filepaths.save_version = filepaths.save_version, 0  # no scene.blend1 among the results
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _check_room(path)
        bpy.ops.wm.save_as_mainfile(filepath=str(path), relative_remap=True, check_existing=False)
    except (OSError, RuntimeError) as error:
        raise RefMeshError(f"{path}: the scene cannot be saved ({_reason(error, path.parent)}); choose another place") from error
    finally:
        filepaths.save_version = versions


def _reason(error: OSError | RuntimeError, folder: Path) -> str:
    """Blender's own message does not tell a full disk from other failures."""
    if isinstance(error, RuntimeError) and os.access(folder, os.W_OK) and shutil.disk_usage(folder).free < _scene_size():
        return os.strerror(errno.ENOSPC)
    return str(error).strip()


def _scene_size() -> int:
    """Bytes of the saved scene, by saving it to the folder for temporary files; 0 when it cannot be saved there either."""
    with tempfile.TemporaryDirectory(prefix="refmesh-") as folder:
        trial = Path(folder) / "scene.blend"
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(trial), copy=True, compress=False, check_existing=False)
        except RuntimeError:
            return 0
        return trial.stat().st_size


def _check_room(path: Path) -> None:
    """Raises OSError when the file would be cut off: Blender reports no error when the disk is full, and the earlier file is lost."""
    trial = path.with_name(f"{path.stem}{PARTIAL_SUFFIX}{path.suffix}")
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(trial), copy=True, compress=False, check_existing=False)
        if LAST_BLOCK not in trial.read_bytes()[-TAIL:]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    finally:
        trial.unlink(missing_ok=True)
