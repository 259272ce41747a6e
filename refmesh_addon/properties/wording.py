"""Texts as the panel shows them: names as labels, and messages that fit the width of a region."""

from __future__ import annotations

import re
import textwrap

import bpy

from ..core.options import label_of, title, value_label
from ..core.settings import flat_fields

PIXELS_PER_LETTER = 6.2  # of Blender's default font at 72 dpi, on average
MARGIN = 60  # pixels of a region that icons and borders take
OPTION = re.compile(r"--([a-z]+(?:-[a-z]+)*)(?: ([a-z_]+)\b)?")  # of the command line, with the choice that follows it
_FIELDS = {item.name: item for item in flat_fields()}


def sentence(text: str) -> str:
    """The text with a capital letter at its start."""
    return text[:1].upper() + text[1:]


def for_window(message: str) -> str:
    """A message with options of the command line named as the panel names them; as it is where there is no window."""
    return message if bpy.app.background else with_labels(message)


def with_labels(message: str) -> str:
    """ "a smaller --group-size" as "a smaller 'Group Size'"."""
    return OPTION.sub(_label, message)


def _label(option: re.Match) -> str:
    name, value = option[1].replace("-", "_"), option[2]
    item = _FIELDS.get(name)
    label = f"'{label_of(item) if item else title(name)}'"
    if value is None:
        return label
    if item and (value in (item.metadata["choices"] or ()) or value == "auto"):
        return f"{label}: {value_label(item, 0 if value == 'auto' else value)}"
    return f"{label} {value}"


def draw_wrapped(layout, text: str, width: int, icon: str = "NONE") -> None:
    """Draws text on as many lines as a region of this width in pixels requires."""
    letters = max(16, int((width - MARGIN) / (PIXELS_PER_LETTER * bpy.context.preferences.system.ui_scale)))
    column = layout.column(align=True)
    column.scale_y = 0.8
    indent = "BLANK1" if icon != "NONE" else "NONE"
    for number, line in enumerate(textwrap.wrap(text, letters)):
        column.label(text=line, icon=indent if number else icon)
