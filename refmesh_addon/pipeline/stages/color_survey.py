"""What color the frames of a take have, before anything is baked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ...io.appearance import files_beside, parse_appearance
from ...io.frame_range import format_frames
from ...io.meshes import read_bytes
from ..session.cache import digest
from ..session.cached_map import WorkUnit, cached_map
from ..session.context import Context
from ..session.stage_share import StageShare

SURVEY_SCHEMA = 1


@dataclass(frozen=True)
class FrameColors:
    """size : longest side of the frame's pictures, pixels; 0 without.  colored : whether it has any color.
    content : digest of the picture files.  notes : sentences about what was wrong.
    """

    size: int
    colored: bool
    content: str
    notes: tuple[str, ...]


def survey(context: Context, share: StageShare) -> Mapping[int, FrameColors]:
    """Colors of all frames by index; warns of what is wrong with them. Frames are read again only when a file beside them has changed."""
    beside: dict[Path, list] = {}
    units = {}
    for index, frame in enumerate(context.frames.sequence.frames):
        if frame.path.parent not in beside:  # listed once, however many frames are there
            beside[frame.path.parent] = files_beside(frame.path)
        key = digest(SURVEY_SCHEMA, context.frames.keys[index], beside[frame.path.parent])
        units[index] = WorkUnit(f"color/survey_{frame.number:04d}", key, lambda path=frame.path: (path,), frame.number)
    colors = cached_map(context, frame_colors, units, FrameColors, share)
    surveyed = {index: colors[index] for index in units}
    _warn(context, surveyed)
    return surveyed


def frame_colors(path: Path) -> FrameColors:
    """One frame's colors."""
    appearance, notes, content = parse_appearance(read_bytes(path), path)
    return FrameColors(0 if appearance is None else appearance.size, appearance is not None, digest(content), notes)


def _warn(context: Context, surveyed: Mapping[int, FrameColors]) -> None:
    """A sentence for each thing that is wrong, and for frames without color among colored ones."""
    for note in dict.fromkeys(note for colors in surveyed.values() for note in colors.notes):
        context.warn(note)
    plain = [context.numbers[index] for index, colors in surveyed.items() if not colors.colored]
    if plain and len(plain) < len(surveyed):
        context.warn(f"{format_frames(plain, context.numbers)}: no color; the steady texture is shown there")
    sizes = {colors.size for colors in surveyed.values() if colors.size}
    if len(sizes) > 1:
        context.warn(f"the pictures of the frames are from {min(sizes)} to {max(sizes)} pixels large; all textures get one size")
