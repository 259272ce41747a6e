"""Selections of frames as text: "6-10,14"."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from math import gcd

from ..core.errors import RefMeshError

RANGES_SHOWN = 6  # ranges that fit into a message of one line


@dataclass(frozen=True)
class FrameRange:
    """The numbers from `first` to `last`, both included."""

    first: int
    last: int

    def __contains__(self, number: int) -> bool:
        return self.first <= number <= self.last


def parse_ranges(text: str) -> tuple[FrameRange, ...]:
    """The ranges that "6-10,14" names; () for an empty text.

    Raises RefMeshError, quoting what is not a number or an ascending range.
    """
    if not text.strip():
        return ()
    return tuple(_parse_range(item.strip(), text) for item in text.split(","))


def _parse_range(item: str, text: str) -> FrameRange:
    match = re.fullmatch(r"(-?[0-9]{1,19})(?:\s*(?:-|to)\s*(-?[0-9]{1,19}))?", item)
    if not match:
        raise RefMeshError(f"--frames '{text}': '{item}' is not a frame or a range; write numbers as in 6-10 or 6-10,14")
    first, last = int(match[1]), int(match[2] or match[1])
    if first > last:
        raise RefMeshError(f"--frames '{text}': '{item}' is descending; write {last}-{first}")
    return FrameRange(first, last)


def format_ranges(numbers: Iterable[int], everything: Iterable[int] = ()) -> str:
    """Numbers as ranges in ascending order, "5-14, 20"; "-3 to 5" where one begins below zero.

    Only the first few and the last where there are many.
    everything : the numbers that exist, where a range is to go on over those that do not. Without it, numbers with a common step
    are "10-50, 70-90 in steps of 10" where that is shorter.
    """
    chosen, known = sorted(set(numbers)), sorted(set(everything))
    step = 1 if known else _common_step(chosen)
    texts = [range_text(first, last) for first, last in ranges_among(chosen, known or _multiples(chosen, step))]
    if len(texts) > RANGES_SHOWN:
        texts[RANGES_SHOWN - 1 : -1] = ["..."]
    return ", ".join(texts) + (f" in steps of {step}" if step > 1 else "")


def format_frames(numbers: Iterable[int], everything: Iterable[int]) -> str:
    """Frames at the start of a message: "frame 5", "frames 5-14, 20"; "38 of 100 frames, between 2 and 97" where ranges are many."""
    chosen, known = sorted(set(numbers)), sorted(set(everything))
    if len(ranges_among(chosen, known)) > RANGES_SHOWN:
        return f"{len(chosen)} of {len(known)} frames, between {chosen[0]} and {chosen[-1]}"
    return f"frame{'s' if len(chosen) > 1 else ''} {format_ranges(chosen, known)}"


def format_others(numbers: Iterable[int], everything: Iterable[int], what: str) -> str:
    """What a message about the worst of some frames adds: " (WHAT in 3 of 100 frames: 5-7)"; "" where it is the only one."""
    chosen, known = sorted(set(numbers)), sorted(set(everything))
    return f" ({what} in {len(chosen)} of {len(known)} frames: {format_ranges(chosen, known)})" if len(chosen) > 1 else ""


def range_text(first: int, last: int) -> str:
    """ "5-14", "5", or "-3 to 5" where the first number is below zero."""
    if first == last:
        return str(first)
    return f"{first} to {last}" if first < 0 else f"{first}-{last}"


def _common_step(numbers: list[int]) -> int:
    """The step of the numbers, if ranges in this step are at most half as many as the numbers; else 1."""
    step = gcd(*(after - before for before, after in pairwise(numbers)))
    runs = 1 + sum(after - before > step for before, after in pairwise(numbers))
    return step if step > 1 and 2 * runs <= len(numbers) and len(numbers) > 2 else 1


def _multiples(numbers: list[int], step: int) -> Iterable[int]:
    """The numbers, and for each the one that would follow it, which ends a range where it is not among them."""
    return {*numbers, *(number + step for number in numbers)}


def ranges_among(chosen: Iterable[int], everything: Iterable[int]) -> list[tuple[int, int]]:
    """First and last of each run of chosen numbers that follow each other in `everything`, whatever its steps."""
    members, before = set(chosen), False
    runs: list[tuple[int, int]] = []
    for number in sorted(everything):
        inside = number in members
        if inside and before:
            runs[-1] = (runs[-1][0], number)
        elif inside:
            runs.append((number, number))
        before = inside
    return runs


def format_selection(chosen: Iterable[int], everything: Iterable[int]) -> str:
    """The text that `parse_ranges` takes for these of all numbers: "6-10,14"."""
    return ",".join(f"{first}-{last}" if last > first else str(first) for first, last in ranges_among(chosen, everything))
