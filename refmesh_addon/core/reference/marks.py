"""Bodies marked by the user, as text: a frame, and points of each body in it, "48: 0.1 0.2 0.3, 0.1 0.3 0.3 | 0.4 0.5 0.6"."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import RefMeshError

EXAMPLE = "48: 0.1 0.2 0.3, 0.1 0.3 0.3 | 0.4 0.5 0.6"


@dataclass(frozen=True)
class Marks:
    """frame : number as in its file name.  bodies : (N, 3) points of each body in that frame, in the coordinates of the files."""

    frame: int
    bodies: tuple[np.ndarray, ...]


def parse_marks(text: str) -> Marks | None:
    """The marks in a text; None for an empty one. Raises RefMeshError, quoting the part that cannot be parsed."""
    if not text.strip():
        return None
    frame, _, rest = text.partition(":")
    if not frame.strip().isdecimal():
        raise RefMeshError(f"--apart: '{_short(frame)}' is not a frame; write the frame and points of each body, as in '{EXAMPLE}'")
    return Marks(int(frame), tuple(np.array([_point(point) for point in body.split(",")]) for body in rest.split("|")))


def marks_as_text(marks: Marks) -> str:
    """The text that `parse_marks` reads; coordinates keep the digits of single precision."""
    bodies = (", ".join(" ".join(_digits(value) for value in point) for point in body) for body in marks.bodies)
    return f"{marks.frame}: {' | '.join(bodies)}"


def _point(text: str) -> list[float]:
    try:
        point = [float(number) for number in text.split()]
    except ValueError:
        point = []
    if len(point) != 3 or not np.isfinite(point).all():
        raise RefMeshError(f"--apart: '{_short(text)}' is not a point; write three numbers for each point, as in '{EXAMPLE}'")
    return point


def _digits(value: float) -> str:
    return np.format_float_positional(np.float32(value), unique=True, trim="-")


def _short(text: str) -> str:
    return text.strip()[:30]
