"""Texts as the panel shows them: names as labels, and messages that fit the width of a region."""

from __future__ import annotations

import textwrap

import bpy

PIXELS_PER_LETTER = 6.2  # of Blender's default font at 72 dpi, on average
MARGIN = 60  # pixels of a region that icons and borders take


def title(name: str) -> str:
    """ "group_size" as the panel writes it: "Group Size"."""
    return name.replace("_", " ").title()


def sentence(text: str) -> str:
    """The text with a capital letter at its start."""
    return text[:1].upper() + text[1:]


def draw_wrapped(layout, text: str, width: int, icon: str = "NONE") -> None:
    """Draws text on as many lines as a region of this width in pixels requires."""
    letters = max(16, int((width - MARGIN) / (PIXELS_PER_LETTER * bpy.context.preferences.system.ui_scale)))
    column = layout.column(align=True)
    column.scale_y = 0.8
    indent = "BLANK1" if icon != "NONE" else "NONE"
    for number, line in enumerate(textwrap.wrap(text, letters)):
        column.label(text=line, icon=indent if number else icon)
