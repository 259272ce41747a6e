"""Selections of frames as text: "6-10,14"."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

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


def format_ranges(numbers: Iterable[int]) -> str:
    """Numbers as ranges in ascending order, "5-14, 20"; "-3 to 5" where one begins below zero.

    Only the first few and the last where there are many.
    """
    ranges: list[list[int]] = []
    for number in sorted(numbers):
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1][1] = number
        else:
            ranges.append([number, number])
    texts = [str(first) if first == last else f"{first} to {last}" if first < 0 else f"{first}-{last}" for first, last in ranges]
    if len(texts) > RANGES_SHOWN:
        texts[RANGES_SHOWN - 1 : -1] = ["..."]
    return ", ".join(texts)


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
