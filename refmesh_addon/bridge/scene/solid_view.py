"""Solid views that show the colors of attributes, while centers or errors are to be seen in them."""

from __future__ import annotations

import bpy

COLORED = "refmesh_colored"  # custom property of a screen: the views that were changed, so that those a person has set stay


def color_solid_views(colored: bool) -> None:
    """Makes views that color objects by their material color them by attribute, or gives them back what they had."""
    for screen in bpy.data.screens:
        changed = set(screen.get(COLORED, ()))
        for number, shading in _shadings(screen):
            if colored and shading.color_type == "MATERIAL":
                shading.color_type = "VERTEX"
                changed.add(number)
            elif not colored and number in changed:
                changed.discard(number)
                shading.color_type = "MATERIAL" if shading.color_type == "VERTEX" else shading.color_type
        if set(screen.get(COLORED, ())) != changed:
            screen[COLORED] = sorted(changed)


def _shadings(screen: bpy.types.Screen) -> list[tuple[int, bpy.types.View3DShading]]:
    """Number of each area with a 3D view, and its shading."""
    spaces = ((number, space) for number, area in enumerate(screen.areas) for space in area.spaces)
    return [(number, space.shading) for number, space in spaces if space.type == "VIEW_3D"]
