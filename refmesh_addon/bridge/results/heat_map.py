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
from ..scene.meshes import set_colors
from ..scene.overrides import override_material, remove_override
from ..scene.paths import absolute_path
from .groups import ERROR_LAYER
from .visibility import switch_kinds

MATERIAL_NAME = "RefMesh Errors"  # another one, on "Col", is of the preview
ATTRIBUTE = ERROR_LAYER
ACTIVE_BEFORE = "refmesh_active_color"  # custom property of the mesh: the color attribute that was active before
_LINEAR = to_linear(np.arange(256) / 255.0)


def switch_heat_map(owner: bpy.types.Object) -> None:
    """Shows the errors as color on the deformed meshes, or what they look like otherwise, as `owner.refmesh.heat_map` says.

    A modifier gives the evaluated mesh another material, so that material slots and the assignment of faces stay as they are.
    """
    state = owner.refmesh
    state.heat_map_frame = ""
    if state.heat_map:
        show_errors(owner, owner.users_scene[0].frame_current)
    for group in state.groups:
        if group.deformed is not None and state.heat_map:
            override_material(group.deformed, attribute_material(MATERIAL_NAME, ATTRIBUTE))
        elif group.deformed is not None:
            _remove_errors(group.deformed)
    switch_kinds(owner)


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
    colors = read_error_colors(absolute_path(owner, state.output) / deformed_path(int(frame.name)))
    if group.deformed is None or len(colors) != len(group.deformed.data.vertices):
        raise RefMeshError(f"frame {frame.name}: its errors are those of another mesh; run Measure Distance again")
    _show_on(group.deformed.data, colors)
    state.heat_map_frame = frame.name


def _show_on(mesh: bpy.types.Mesh, colors: np.ndarray) -> None:
    """Writes the colors and makes them the active ones, which solid views show."""
    if ATTRIBUTE not in mesh.attributes:
        mesh[ACTIVE_BEFORE] = mesh.color_attributes.active_color_name
    set_colors(mesh, colors, ATTRIBUTE)
    mesh.color_attributes.active_color = mesh.color_attributes[ATTRIBUTE]


def _remove_errors(member: bpy.types.Object) -> None:
    remove_override(member)
    mesh = member.data
    if ATTRIBUTE in mesh.attributes:
        mesh.attributes.remove(mesh.attributes[ATTRIBUTE])
        before = mesh.color_attributes.get(mesh.pop(ACTIVE_BEFORE, ""))
        if before is not None:
            mesh.color_attributes.active_color = before


def read_error_colors(path: Path) -> np.ndarray:
    """(R, 4) linear colors of a deformed frame. Raises RefMeshError when it has none, since nothing was measured."""
    return _LINEAR[read_colors(path)]
