"""What the session reads from the window of Blender, and how it presses keys there."""

from __future__ import annotations

import bpy


def press(key: str, area: bpy.types.Area | bpy.types.Region) -> None:
    """A key, with the mouse in the middle of the area or region."""
    window = bpy.context.window_manager.windows[-1]
    place = {"x": area.x + area.width // 2, "y": area.y + area.height // 2}
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", **place)
    for value in ("PRESS", "RELEASE"):
        window.event_simulate(type=key, value=value, **place)


def owner() -> bpy.types.Object:
    return next(iter(member for member in bpy.data.objects if member.refmesh.frames), None)


def job() -> bpy.types.Operator | None:
    operators = (operator for window in bpy.context.window_manager.windows for operator in window.modal_operators)
    return next((operator for operator in operators if operator.bl_idname.startswith("REFMESH_OT_")), None)


def view() -> dict:
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    return {"window": window, "area": area, "region": next(region for region in area.regions if region.type == "WINDOW")}
