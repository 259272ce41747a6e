"""Velocities of the vertices, for motion blur, on what an exporter walks through frame by frame.

Blender's writers of Alembic and USD take the point attribute `velocity` of each frame along as the velocities of the mesh. Both
formats count in seconds, and so do the programs that read them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import RefMeshError
from ...io.ply import read_velocities
from ..sequence.raw_sequence import frame_at

ATTRIBUTE = "velocity"


@contextmanager
def moving(owner: bpy.types.Object, copies: dict[int, bpy.types.Object], report: dict, results: Path) -> Iterator[None]:
    """Inside the block every change of frame gives the stand-ins of the sequence object `owner` their velocities.

    copies : index of group -> its stand-in; those of other groups than the frame's stand still.  report, results : of the run.
    Raises RefMeshError when the frames carry no velocities.
    """
    frames = {frame["number"]: frame for frame in report["frames"]}
    rate = bpy.context.scene.render.fps / bpy.context.scene.render.fps_base

    def show(scene: bpy.types.Scene, _depsgraph: object = None) -> None:
        frame = frames[int(frame_at(owner, scene.frame_current).name)]
        for index, copy in copies.items():
            speeds = np.zeros((len(copy.data.vertices), 3))
            if index == frame["group"]:
                speeds = rate * _velocities(results / frame["deformed"], len(speeds))
            _write(copy.data, speeds)

    checked = [frame for frame in frames.values() if frame["group"] in copies]
    for frame in checked:  # before anything is written: an error in the handler would reach the console only
        _velocities(results / frame["deformed"], len(copies[frame["group"]].data.vertices))
    show(bpy.context.scene)
    bpy.app.handlers.frame_change_pre.append(show)
    try:
        yield
    finally:
        bpy.app.handlers.frame_change_pre.remove(show)


def _velocities(path: Path, vertices: int) -> np.ndarray:
    found = read_velocities(path)
    if len(found) != vertices:
        raise RefMeshError(f"{path}: has {len(found)} vertices, but its group's mesh has {vertices}; run the Deform step again")
    return found


def _write(mesh: bpy.types.Mesh, velocities: np.ndarray) -> None:
    attribute = mesh.attributes.get(ATTRIBUTE) or mesh.attributes.new(ATTRIBUTE, "FLOAT_VECTOR", "POINT")
    attribute.data.foreach_set("vector", velocities.astype(np.float32).ravel())
    mesh.update()
