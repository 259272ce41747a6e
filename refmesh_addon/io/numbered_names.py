"""Numbers in the names of files, and which of them counts the frames, found by looking at all names.

Names may hold several: of the frame, a time stamp, a level of detail, a camera, a take. One that counts frames runs in small steps;
others either follow it, as time stamps do, or select one of several sequences, as levels of detail do.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

# A minus is a sign behind a separator or at the beginning, a separator behind a letter or digit.
_NUMBER = re.compile(r"(?:(?<![^_\-. (/])-)?[0-9]+")
_FRAME_WORD = re.compile(r"(?:^|[^a-z])(?:frame|frm|fr)[^a-z]*$", re.IGNORECASE)
_OTHER_WORD = re.compile(
    r"(?:^|[^a-z])(?:lod|level|camera|cam|view|take|shot|scene|version|ver|v|person|actor|body|part)[^a-z]*$", re.IGNORECASE
)
MAX_STEP = 10  # of a number that counts frames, on average; time stamps take longer ones
STAMP_DIGITS = 6  # a longer number that never falls while the frames rise is a time stamp, even where it repeats
MAX_DIGITS = 18  # of a number that still fits into a 64-bit integer


@dataclass(frozen=True)
class NumberedName:
    """path : of the file.  text : its path below the folder that all frames share, without suffix, with forward slashes."""

    path: Path
    text: str

    @cached_property
    def digits(self) -> tuple[str, ...]:
        """The numbers in the text, as they are written."""
        return tuple(_NUMBER.findall(self.text))

    @cached_property
    def numbers(self) -> tuple[int, ...]:
        """The numbers in the text; of one with more than 18 digits the first 18, as nothing could count so far."""
        return tuple(int(digits[: MAX_DIGITS + 1]) for digits in self.digits)

    @cached_property
    def between(self) -> tuple[str, ...]:
        """The text around the numbers, one part more than there are numbers."""
        return tuple(_NUMBER.split(self.text))

    @property
    def counts_no_frames(self) -> bool:
        """Whether each number stands behind the word for something else, as in "lod1"."""
        return all(_OTHER_WORD.search(before) for before in self.between[:-1])

    @property
    def kind(self) -> str:
        """The suffix in lower case."""
        return self.path.suffix.lower()


@dataclass(frozen=True)
class Reading:
    """One way to read numbers in names.  field : the number that counts frames.  selectors : numbers that tell sequences apart."""

    field: int
    selectors: tuple[int, ...] = ()

    def sequence_of(self, name: NumberedName) -> tuple[int, ...]:
        """Equal for names of one sequence."""
        return tuple(name.numbers[selector] for selector in self.selectors)

    def pattern(self, name: NumberedName) -> str:
        """The text of a name with "#" for the frame, its own digits for what selects its sequence, and "*" for what follows the frame."""
        shown = ["#" if field == self.field else digits if field in self.selectors else "*" for field, digits in enumerate(name.digits)]
        return "".join(text + number for text, number in zip(name.between, [*shown, ""], strict=True))


def readings(names: Sequence[NumberedName]) -> list[Reading]:
    """The ways to read names with the same text around their numbers, the most likely first; [] for names without numbers."""
    count = len(names[0].digits)
    if not count:
        return []
    distinct = [len({name.numbers[field] for name in names}) for field in range(count)]
    varying = [field for field in range(count) if distinct[field] > 1]
    if not varying:
        return [Reading(count - 1, tuple(range(count - 1)))]
    constant = tuple(field for field in range(count) if distinct[field] == 1)
    ranked = sorted(varying, key=lambda field: _likelihood(names, field), reverse=True)
    return [Reading(field, tuple(sorted(constant + _selectors(names, field, varying)))) for field in ranked]


def _likelihood(names: Sequence[NumberedName], field: int) -> tuple:
    """What speaks for a number as that of the frame, the weightiest first."""
    before = names[0].between[field]
    values = sorted({name.numbers[field] for name in names})
    step = (values[-1] - values[0]) / (len(values) - 1)
    padded = sum(len(name.digits[field]) > 1 and name.digits[field].lstrip("-").startswith("0") for name in names)
    hint = 1 if _FRAME_WORD.search(before) else -1 if _OTHER_WORD.search(before) else 0
    return hint, step <= MAX_STEP, len(values), -step, padded > 0, field


def _selectors(names: Sequence[NumberedName], field: int, varying: Sequence[int]) -> tuple[int, ...]:
    """The other numbers that tell sequences apart: as few as leave each frame once, and those that do not follow the frame."""
    pool = sorted((other for other in varying if other != field), key=lambda other: len({name.numbers[other] for name in names}))
    chosen: list[int] = []
    while pool and not _each_frame_once(names, field, chosen):  # each round takes one out
        chosen.append(pool.pop(0))
    return (*chosen, *(other for other in pool if not _follows(names, other, field, chosen)))


def _each_frame_once(names: Sequence[NumberedName], field: int, selectors: Sequence[int]) -> bool:
    return len({(name.numbers[field], *(name.numbers[other] for other in selectors)) for name in names}) == len(names)


def _follows(names: Sequence[NumberedName], other: int, field: int, selectors: Sequence[int]) -> bool:
    """Whether a number has another value in each frame of every sequence, or is a time stamp that never falls."""
    sequences: dict[tuple[int, ...], list[tuple[int, int]]] = {}
    for name in names:
        key = tuple(name.numbers[selector] for selector in selectors)
        sequences.setdefault(key, []).append((name.numbers[field], name.numbers[other]))
    stamp = all(len(name.digits[other]) >= STAMP_DIGITS for name in names)
    return all(_differs_or_rises([value for _, value in sorted(rows)], stamp) for rows in sequences.values())


def _differs_or_rises(values: list[int], stamp: bool) -> bool:
    return len(set(values)) == len(values) or (stamp and values == sorted(values))
