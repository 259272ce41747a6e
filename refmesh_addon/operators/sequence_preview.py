"""What would be imported, as the file browser shows it."""

from functools import lru_cache

import numpy as np

from ..core.errors import RefMeshError
from ..io.discovery import find_sequence
from ..io.frame_range import format_ranges
from ..io.sequence import Sequence
from ..properties.wording import for_window

MAX_BYTES = 20_000_000  # of a file that is read while the file browser is drawn
ICONS = ("SEQUENCE", "PREVIEW_RANGE", "BLANK1", "FILE_BLANK")  # of the lines of a summary


def draw_preview(layout, source: str, frames: str, unit: float):
    """Draws the summary of a sequence and the size of its first frame; `unit` is the length of a unit of the files in meters."""
    lines = summarize(source, frames)
    for line, icon in zip(lines, ICONS):
        layout.label(text=line, icon=icon)
    size = first_frame_size(source, frames) if len(lines) == len(ICONS) else ()
    if size:
        layout.label(text=format_meters(size, unit), icon="CON_SIZELIMIT")


def describe(sequence: Sequence) -> str:
    """One line about a sequence: name, count, range, gaps."""
    gaps = f", missing {format_ranges(sequence.gaps)}" if sequence.gaps else ""
    return f"{sequence.name}: {len(sequence.frames)} frames, {format_ranges(sequence.numbers)}{gaps}"


@lru_cache(maxsize=8)
def summarize(source: str, frames: str) -> tuple[str, ...]:
    """Name, frames, gaps and size of what would be imported, or why nothing would be. Cached, as the file browser draws often."""
    try:
        sequence = find_sequence(source, frames)
        size = sum(frame.path.stat().st_size for frame in sequence.frames)
    except (RefMeshError, OSError) as error:
        return (for_window(str(error)),)
    gaps = f"missing: {format_ranges(sequence.gaps)}" if sequence.gaps else "no gaps"
    return (sequence.name, f"{len(sequence.frames)} frames: {format_ranges(sequence.numbers)}", gaps, format_bytes(size))


@lru_cache(maxsize=8)
def first_frame_size(source: str, frames: str) -> tuple[float, ...]:
    """Sides of the bounding box of the first frame, in the units of the file; () where it cannot be read, or not quickly."""
    try:
        path = find_sequence(source, frames).frames[0].path
        if path.stat().st_size > MAX_BYTES:
            return ()
        from ..io.meshes import read_mesh

        return tuple(map(float, np.ptp(read_mesh(path).vertices, axis=0)))
    except (RefMeshError, OSError):
        return ()


def format_meters(sides: tuple[float, ...], unit: float) -> str:
    """(170, 60, 25) in centimeters as "1.7 x 0.6 x 0.25 m": whether the unit is the right one."""
    return " x ".join(f"{unit * side:.3g}" for side in sides) + " m"


def format_bytes(size: int) -> str:
    """1234567 as "1.2 MB"."""
    return f"{size / 1e9:.2f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"
