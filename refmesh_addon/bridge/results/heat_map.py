"""The error of the deformed mesh as color, frame by frame, from the colored PLY files of the results."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ...core.errors import RefMeshError
from ...core.evaluation.error_scale import to_linear
from ...io.ply import read_colors
from ...io.report import deformed_path
from ..scene.materials import attribute_material
from ..scene.meshes import COLOR_NAME, set_colors
from .groups import deformed_material

MATERIAL_NAME = "RefMesh Error"
_LINEAR = to_linear(np.arange(256) / 255.0)


def switch_heat_map(owner: bpy.types.Object) -> None:
    """Gives the deformed meshes the colors of their errors, or their plain color, as `owner.refmesh.heat_map` says."""
    state = owner.refmesh
    material = attribute_material(MATERIAL_NAME, COLOR_NAME) if state.heat_map else deformed_material()
    for group in state.groups:
        if group.deformed is not None:
            group.deformed.data.materials.clear()
            group.deformed.data.materials.append(material)
    state.heat_map_frame = ""
    if state.heat_map:
        show_errors(owner, owner.users_scene[0].frame_current)


def show_errors(owner: bpy.types.Object, scene_frame: int) -> None:
    """Colors the mesh of the group that `scene_frame` shows. Raises RefMeshError when that frame has no errors."""
    state = owner.refmesh
    frames = [frame for frame in state.frames if frame.is_property_set("distance")]
    shown = [frame for frame in frames if frame.scene_frame <= scene_frame] or frames[:1]
    if not shown:
        raise RefMeshError("the errors are not measured yet; run Measure Distance first")
    frame = max(shown, key=lambda item: item.scene_frame)
    if frame.name == state.heat_map_frame:
        return
    group = max((item for item in state.groups if item.start <= frame.scene_frame), key=lambda item: item.start)
    colors = read_error_colors(Path(bpy.path.abspath(state.output)) / deformed_path(int(frame.name)))
    if group.deformed is None or len(colors) != len(group.deformed.data.vertices):
        raise RefMeshError(f"frame {frame.name}: its errors are those of another mesh; run Measure Distance again")
    set_colors(group.deformed.data, colors)
    state.heat_map_frame = frame.name


def read_error_colors(path: Path) -> np.ndarray:
    """(R, 4) linear colors of a deformed frame. Raises RefMeshError when it has none, since nothing was measured."""
    return _LINEAR[read_colors(path)]
