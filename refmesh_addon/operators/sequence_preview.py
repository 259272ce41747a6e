"""What would be imported, as the file browser shows it."""

from functools import lru_cache
from pathlib import Path

import bpy
import numpy as np

from ..core.capture.scale import meters, scale_note
from ..core.counted import counted
from ..core.errors import RefMeshError
from ..io.discovery import find_sequence
from ..io.frame_range import format_ranges
from ..io.sequence import Sequence
from ..pipeline.process.reading import read_frame, read_surface_kind
from ..properties.wording import draw_wrapped, for_window

AUTOMATIC_READING = ("AUTO", "Automatic", "The number that runs through the names counts the frames")
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
        note = scale_note(unit * max(size))
        if note:
            draw_wrapped(layout, note, bpy.context.region.width, icon="INFO")
    for note in sequence_notes(source, frames):
        draw_wrapped(layout, note, bpy.context.region.width, icon="INFO")


@lru_cache(maxsize=8)
def sequence_notes(source: str, frames: str) -> tuple[str, ...]:
    """What is said about files that would be left out, and about how their names were read; () where nothing would be imported."""
    try:
        return find_sequence(source, frames).notes
    except (RefMeshError, OSError):
        return ()


@lru_cache(maxsize=8)
def reading_items(source: str, frames: str) -> list[tuple[str, str, str]]:
    """Identifier, label and description of each way to read the names of a sequence; "" is the most likely one."""
    try:
        sequence = find_sequence(source, frames)
    except (RefMeshError, OSError):
        return [AUTOMATIC_READING]
    others = [(pattern, Path(pattern).name, f"Take the files that are named like {pattern}") for pattern in sequence.readings[1:]]
    return [AUTOMATIC_READING, *others]  # kept by the cache: Blender needs the texts for as long as it shows them


def describe(sequence: Sequence) -> str:
    """One line about a sequence: name, count, range, gaps, notes."""
    gaps = f", missing {format_ranges(sequence.gaps)}" if sequence.gaps else ""
    notes = "".join(f"; {note}" for note in sequence.notes)
    return f"{sequence.name}: {counted(len(sequence.frames), 'frame')}, {format_ranges(sequence.numbers)}{gaps}{notes}"


@lru_cache(maxsize=8)
def summarize(source: str, frames: str) -> tuple[str, ...]:
    """Name, frames, gaps and size of what would be imported, or why nothing would be. Cached, as the file browser draws often."""
    try:
        sequence = find_sequence(source, frames)
        size = sum(frame.path.stat().st_size for frame in sequence.frames)
    except (RefMeshError, OSError) as error:
        return (for_window(str(error)),)
    gaps = f"missing: {format_ranges(sequence.gaps)}" if sequence.gaps else "no gaps"
    return (sequence.name, f"{counted(len(sequence.frames), 'frame')}: {format_ranges(sequence.numbers)}", gaps, format_bytes(size))


@lru_cache(maxsize=8)
def first_frame_size(source: str, frames: str) -> tuple[float, ...]:
    """Sides of the bounding box of the first frame, in the units of the file; () where it cannot be read, or not quickly."""
    try:
        path = find_sequence(source, frames).frames[0].path
        if path.stat().st_size > MAX_BYTES:
            return ()
        return tuple(map(float, np.ptp(read_frame(path).vertices, axis=0)))
    except (RefMeshError, OSError, ImportError):
        return ()


def first_frame_kind(path: Path) -> str:
    """What kind of capture a frame shows, in a clause; "" where it cannot be told, or not quickly: the check tells it of the take."""
    try:
        from ..core.capture.openness import DESCRIPTIONS  # late: SciPy comes with it, and may be missing

        return f"its first frame shows {DESCRIPTIONS[read_surface_kind(path)]}" if path.stat().st_size <= MAX_BYTES else ""
    except (RefMeshError, OSError, ImportError):
        return ""


def format_meters(sides: tuple[float, ...], unit: float) -> str:
    """(170, 60, 25) in centimeters as "1.7 x 0.6 x 0.25 m": whether the unit is the right one."""
    return " x ".join(meters(unit * side) for side in sides) + " m"


def format_bytes(size: int) -> str:
    """1234567 as "1.2 MB"."""
    return f"{size / 1e9:.2f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"
