"""A mesh sequence: its frames by number, and the scene frames that show them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

BAKED_FOLDER = "source"  # in the output folder: frames that RefMesh itself has written from an animated object
BLENDER_LAST_FRAME = 1_048_574  # Blender's timeline ends here


@dataclass(frozen=True)
class Frame:
    """One file of a sequence and the number in its name, which may be below zero."""

    number: int
    path: Path


@dataclass(frozen=True)
class Sequence:
    """Frames in the order of their numbers.

    gaps : numbers that are missing between the frames.
    step : distance of neighboring numbers (10 for 10, 20, 30); 0 when the numbers are time stamps without a step.
    notes : sentences about files that were left out and about how names were read.
    readings : where names can be read in several ways, a pattern for each, as `find_sequence` takes them; the first is this one.
    """

    name: str
    frames: tuple[Frame, ...]
    gaps: tuple[int, ...] = ()
    step: int = 1
    notes: tuple[str, ...] = ()
    readings: tuple[str, ...] = ()

    @cached_property
    def numbers(self) -> tuple[int, ...]:
        """The number of each frame, rising."""
        return tuple(frame.number for frame in self.frames)

    @cached_property
    def folder(self) -> Path:
        """The folder that holds all frames; where each has a folder of its own, the one around these."""
        return Path(os.path.commonpath({frame.path.parent for frame in self.frames}))


def timeline_frame(sequence: Sequence, number: int) -> int:
    """Scene frame that shows frame `number`: its own number, or the first number and then one scene frame for each step.

    Sequences that would begin below 0, where no render begins, or end beyond Blender's last scene frame start at scene frame 1 instead.
    """
    first, last = (_unshifted(sequence, sequence.numbers[end]) for end in (0, -1))
    shift = 1 - first if first < 0 or last > BLENDER_LAST_FRAME else 0
    return _unshifted(sequence, number) + shift


def held_frames(sequence: Sequence, numbers: tuple[int, ...] = ()) -> tuple[int, ...]:
    """For each scene frame from first to last, the index of the frame it shows; a missing frame holds the one before.

    numbers : of the frames that are shown, in order, the first and the last of the sequence among them; empty for all.
    """
    starts = [timeline_frame(sequence, number) for number in numbers or sequence.numbers]
    lengths = [after - before for before, after in pairwise(starts)] + [1]
    return tuple(index for index, length in enumerate(lengths) for _ in range(length))


def _unshifted(sequence: Sequence, number: int) -> int:
    first = sequence.numbers[0]
    if sequence.step:
        return first + (number - first) // sequence.step
    return first + sequence.numbers.index(number)
