"""Velocities of the vertices, for motion blur, on the objects that an exporter evaluates frame by frame.

Blender's exporters of Alembic and USD write the point attribute `velocity` of each frame as the velocities of the mesh. Both
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
from ...io.report import read_report
from ..scene.timeline import timeline
from .export import Export
from .frame_changes import at_each_frame
from .stand_ins import cached_stand_ins

ATTRIBUTE = "velocity"


@contextmanager
def moving_stand_ins(export: Export) -> Iterator[dict[int, bpy.types.Object]]:
    """Stand-ins that carry velocities, in a timeline of the chosen frames. Raises RefMeshError when frames carry no velocities."""
    choice = export.choice
    with (
        cached_stand_ins(export) as copies,
        timeline(bpy.context.scene, choice.first, choice.last),
        _moving(export, copies),
    ):
        yield copies


@contextmanager
def _moving(export: Export, copies: dict[int, bpy.types.Object]) -> Iterator[None]:
    """Inside the block every change of frame gives the stand-ins their velocities.

    copies : index of group -> its stand-in. Those of groups other than the frame's stand still.
    """
    frames = read_report(export.results)["frames"]
    rate = bpy.context.scene.render.fps / bpy.context.scene.render.fps_base

    def show(frame: dict) -> None:
        for index, copy in copies.items():
            velocities = np.zeros((len(copy.data.vertices), 3))
            if index == frame["group"]:
                velocities = rate * _velocities(export.results / frame["deformed"], len(velocities))
            _set_velocities(copy.data, velocities)

    for frame in frames:  # before anything is written: an error in the handler would reach the console only
        if frame["group"] in copies:
            _velocities(export.results / frame["deformed"], len(copies[frame["group"]].data.vertices))
    with at_each_frame(export.owner, frames, show):
        yield


def _velocities(path: Path, vertices: int) -> np.ndarray:
    velocities = read_velocities(path)
    if len(velocities) != vertices:
        raise RefMeshError(f"{path}: has {len(velocities)} vertices, but its group's mesh has {vertices}; run the Deform step again")
    return velocities


def _set_velocities(mesh: bpy.types.Mesh, velocities: np.ndarray) -> None:
    attribute = mesh.attributes.get(ATTRIBUTE) or mesh.attributes.new(ATTRIBUTE, "FLOAT_VECTOR", "POINT")
    attribute.data.foreach_set("vector", velocities.astype(np.float32).ravel())
    mesh.update()
