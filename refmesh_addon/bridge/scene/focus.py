"""What one looks at: selects an object alone and frames it in the 3D views."""

from __future__ import annotations

import bpy
import numpy as np

STARTUP_CUBE = ("Cube", 8, 2.0)  # name, vertices and side of the mesh that Blender's startup scene contains


def focus(member: bpy.types.Object) -> None:
    """Makes it the active and only selected object and frames it in the 3D views of the window."""
    layer = bpy.context.view_layer
    for selected in list(bpy.context.selected_objects):
        selected.select_set(False)
    layer.objects.active = member
    layer.update()
    if member.visible_get():
        member.select_set(True)
        frame_selected()


def frame_selected() -> None:
    """Frames the selected objects in the 3D views of the window; does nothing without a window."""
    window = None if bpy.app.background else bpy.context.window
    for area in window.screen.areas if window else ():
        region = next((region for region in area.regions if region.type == "WINDOW"), None)
        if area.type == "VIEW_3D" and region is not None:
            with bpy.context.temp_override(window=window, area=area, region=region):
                bpy.ops.view3d.view_selected()


def hide_startup_cube(scene: bpy.types.Scene) -> bool:
    """Hides the cube of Blender's startup scene, where nobody has touched it: it would stand inside the capture."""
    name, vertices, side = STARTUP_CUBE
    cube = scene.objects.get(name)
    if cube is None or cube.type != "MESH" or len(cube.data.vertices) != vertices or cube.modifiers or cube.animation_data:
        return False
    if cube.location.length > 0 or any(abs(length - side) > 1e-6 for length in cube.dimensions) or not cube.visible_get():
        return False
    cube.hide_set(True)
    cube.hide_render = True
    return True


def longest_side(owner: bpy.types.Object, scene: bpy.types.Scene) -> float:
    """Longest side of the mesh of a sequence with the scale of its root, in meters."""
    corners = np.array([corner[:] for corner in owner.bound_box])
    return float(np.ptp(corners, axis=0).max()) * max(owner.refmesh.root.scale) * scene.unit_settings.scale_length
