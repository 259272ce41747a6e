"""Texts as the panel shows them: names as labels, and messages that fit the width of a region."""

from __future__ import annotations

import re
import textwrap
from bisect import bisect_right

import blf
import bpy

from ..core.options import label_of, title, value_label
from ..core.settings import flat_fields

MARGIN = 84  # pixels of a region that tabs, icons and borders take, at a resolution scale of 1
LEAST_WIDTH = 100  # pixels of a line, however narrow the region is
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
    column = layout.column(align=True)
    column.scale_y = 0.8
    indent = "BLANK1" if icon != "NONE" else "NONE"
    scale = bpy.context.preferences.system.ui_scale or 1.0  # 0 in background mode
    for number, line in enumerate(wrapped(text, max(width / scale - MARGIN, LEAST_WIDTH))):
        column.label(text=line, icon=indent if number else icon)


def wrapped(text: str, width: float) -> list[str]:
    """Lines in the font of the interface, none wider than `width` pixels at a resolution scale of 1; longer words are broken."""
    blf.size(0, bpy.context.preferences.ui_styles[0].widget.points)
    rest, lines = " ".join(text.split()), []
    while rest:
        letters = bisect_right(range(len(rest)), width, lo=1, key=lambda count: blf.dimensions(0, rest[: count + 1])[0])
        lines.append(textwrap.wrap(rest, letters, break_on_hyphens=False)[0])
        rest = rest[len(lines[-1]) :].lstrip()
    return lines
