"""Discovers the frames of a mesh sequence by their file names; never opens a mesh.

Padding, prefix, first number, gaps and numbers below zero do not matter. Frames may lie in a folder each, and their format may change
in the middle. What is left out is said in the notes of the sequence, and other ways to read the names are offered as patterns.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from ..core.errors import RefMeshError
from .formats import FRAME_FORMATS, frame_format
from .frame_files import files_matching, meshes_in, meshes_in_numbered_folders, meshes_in_sibling_folders, named
from .frame_range import FrameRange, format_ranges, parse_ranges
from .numbered_names import MAX_DIGITS, NumberedName, Reading, readings
from .sequence import Frame, Sequence

# More missing numbers than this for each file: the numbers are time stamps (milliseconds, say), not a count of frames.
MAX_GAPS_PER_FRAME = 10
MOST_SHOWN = 200  # characters of a path in a message
CANDIDATES_SHOWN = 4  # sequences that a message lists


def find_sequence(source: str | Path, frames: str = "") -> Sequence:
    """The sequence that `source` names: a folder, one file of a sequence, or a pattern.

    A folder gives the meshes in it, or, where it has none, those in its numbered folders. A file gives all files whose names differ
    from its own in the number of the frame only; a file without a number is a sequence of one frame, number 1. In a pattern "*"
    stands for anything and "#" for the number of the frame; without "#" it is found.
    `frames` chooses by number, ends included: "6-10", "6-10,14"; "" takes all.
    Raises RefMeshError when there is no such sequence, when there are several, or when a chosen number does not exist.
    """
    ranges = parse_ranges(frames)
    try:
        sequence = _sequence_of(str(source))
    except (OSError, ValueError) as error:  # a name that the system does not allow, a folder that is removed while it is read
        raise RefMeshError(f"{str(source)[:MOST_SHOWN]}: cannot be read ({getattr(error, 'strerror', None) or error})") from error
    return _chosen(sequence, ranges) if ranges else sequence


def _sequence_of(source: str) -> Sequence:
    path = Path(source)
    if path.is_dir():
        return _only_sequence(named(meshes_in(path) or meshes_in_numbered_folders(path)), source)
    if path.is_file():
        return _sequence_with(path)
    numbered = files_matching(source)
    if numbered is None:
        raise RefMeshError(f"{source}: no such file or folder; give a folder, one file of a sequence, or a pattern such as 'scan_*.obj'")
    names, numbers = numbered
    if names and numbers:
        return _build(dict(zip(names, numbers, strict=True)), [], _Reason())
    return _only_sequence(names, source)


def _first_of(names: list[NumberedName]) -> str:
    """The first file by name, and how many more there are."""
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return f"{names[0].text}{names[0].path.suffix}{more}"


class _Reason:
    """Collects what a sequence says of itself: what was left out, and how else names could be read."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        self.readings: list[str] = []

    def left_out(self, names: Iterable[NumberedName], reason: str) -> None:
        others = sorted(names, key=lambda name: name.text + name.path.suffix)
        if others:
            self.notes.append(f"left out: {_first_of(others)}, {reason}")


def _sequence_with(path: Path) -> Sequence:
    frame_format(path)  # refuses what cannot be read
    beside = named(meshes_in(path.parent) or [path])
    sequence = _read_with(path, beside)
    if len(sequence.frames) > 1 and not NumberedName(path, path.stem).counts_no_frames:
        return sequence
    in_folders = _read_with(path, named(meshes_in_sibling_folders(path)))
    if len(in_folders.frames) < 2:
        return sequence
    note = f"each frame is in a folder of its own, such as {path.parent.name}; put the file alone in a folder to take only it"
    return replace(in_folders, notes=(note, *in_folders.notes))


def _read_with(path: Path, names: list[NumberedName]) -> Sequence:
    picked = next((name for name in names if name.path.name == path.name and name.path.parent == path.parent), None)
    picked = picked or NumberedName(path, path.stem)
    alike = [name for name in names if name.between == picked.between]
    reason = _Reason()
    kept = _one_kind(alike or [picked], picked.kind, reason)
    found = readings(kept)
    if not found:
        return _build({picked: 1}, found, reason)
    best, own = found[0], found[0].sequence_of(picked)
    members = [name for name in kept if best.sequence_of(name) == own]
    others = (name for name in kept if best.sequence_of(name) != own)
    reason.left_out(others, "which differ in another number: pick one of them to take them instead")
    return _build({name: name.numbers[best.field] for name in members}, found, reason, picked)


def _only_sequence(names: list[NumberedName], source: str) -> Sequence:
    if not names:
        raise RefMeshError(f"{source}: no meshes found; expected files such as frame_0001.obj ({', '.join(FRAME_FORMATS)})")
    if len(names) == 1:
        return _read_with(names[0].path, names)
    numbered = [name for name in names if name.digits]
    if not numbered:
        raise RefMeshError(f"{source}: the names of its {len(names)} meshes carry no frame number; number them, as in frame_0001.obj")
    kind = _most_frequent_kind(names)
    candidates = _sequences(numbered, kind)
    first = _only(candidates, source)
    sequence = _read_with(first.path, names)
    others = _Reason()
    others.left_out((name for name in names if name.between != first.between and not name.digits), "without a number")
    others.left_out((name for name in names if name.between != first.between and name.digits), "of another name and format")
    return replace(sequence, notes=(*sequence.notes, *others.notes))


def _sequences(names: list[NumberedName], kind: str) -> list[list[NumberedName]]:
    """The sequences that hold files of a kind, in the order of their names."""
    alike: dict[tuple[str, ...], list[NumberedName]] = {}
    for name in names:
        alike.setdefault(name.between, []).append(name)
    sequences: list[list[NumberedName]] = []
    for members in alike.values():
        kept = _one_kind(members, kind if any(name.kind == kind for name in members) else members[0].kind, _Reason())
        best = readings(kept)[0]
        groups: dict[tuple[int, ...], list[NumberedName]] = {}
        for name in kept:
            groups.setdefault(best.sequence_of(name), []).append(name)
        sequences += [group for group in groups.values() if any(name.kind == kind for name in group)]
    return sequences


def _only(candidates: list[list[NumberedName]], source: str) -> NumberedName:
    if len(candidates) > 1:
        shown = [_first_of(group) for group in candidates[:CANDIDATES_SHOWN]]
        others = len(candidates) - CANDIDATES_SHOWN
        listed = "; ".join(shown) + (f"; and {others} others" if others > 0 else "")
        raise RefMeshError(f"{source}: several sequences found ({listed}); give one file of the one you mean")
    return candidates[0][0]


def _most_frequent_kind(names: list[NumberedName]) -> str:
    counts = Counter(name.kind for name in names if name.digits)
    return max(FRAME_FORMATS, key=lambda extension: counts[extension])


def _one_kind(names: list[NumberedName], kind: str, reason: _Reason) -> list[NumberedName]:
    """All names where each has other numbers, as in a take that changes its format; else those of a kind."""
    if len({name.numbers for name in names}) == len(names) or len({name.kind for name in names}) == 1:
        return names
    reason.left_out((name for name in names if name.kind != kind), f"which show the same frames as the {kind} files")
    return [name for name in names if name.kind == kind]


def _build(numbers: dict[NumberedName, int], found: list[Reading], reason: _Reason, picked: NumberedName | None = None) -> Sequence:
    by_number: dict[int, NumberedName] = {}
    for name, number in numbers.items():
        _check_encoding(name.path)
        if abs(number) >= 10**MAX_DIGITS:
            raise RefMeshError(f"{name.path}: the frame number has more than {MAX_DIGITS} digits; rename the files")
        if number in by_number:
            first, second = sorted((by_number[number].path.name, name.path.name))
            raise RefMeshError(f"{name.path.parent}: {first} and {second} are both frame {number}; remove one of them")
        by_number[number] = name
    ordered = sorted(by_number)
    gaps, step = _gaps_and_step(ordered)
    _note_kinds(by_number, reason)
    if picked is not None:
        _note_readings(found, picked, reason)
    title = _name(by_number[ordered[0]], found[0].field if found else None, ordered[0])
    frames = tuple(Frame(number, by_number[number].path) for number in ordered)
    return Sequence(title, frames, gaps, step, tuple(reason.notes), tuple(reason.readings))


def _check_encoding(path: Path) -> None:
    """Raises RefMeshError for a name that is not Unicode, as some systems allow: neither Blender nor the report can hold it."""
    shown = str(path).encode("utf-8", "backslashreplace").decode("utf-8")
    if shown != str(path):
        raise RefMeshError(f"{shown}: its name is not valid Unicode; rename it")


def _note_kinds(by_number: dict[int, NumberedName], reason: _Reason) -> None:
    kinds = {name.kind for name in by_number.values()}
    if len(kinds) > 1:
        parts = [f"{format_ranges(n for n, name in by_number.items() if name.kind == kind)} are {kind} files" for kind in sorted(kinds)]
        reason.notes.append(f"frames of several formats: {', '.join(parts)}")


def _note_readings(found: list[Reading], picked: NumberedName, reason: _Reason) -> None:
    if len(found) > 1:
        folder = picked.path.parents[picked.text.count("/")]
        patterns = [str(folder / (reading.pattern(picked) + picked.path.suffix)) for reading in found]
        reason.readings += patterns
        others = " or ".join(f"'{Path(pattern).relative_to(folder)}'" for pattern in patterns[1:])
        reason.notes.append(f"frames are numbered as in '{Path(patterns[0]).relative_to(folder)}'; for another reading give {others}")


def _name(first: NumberedName, field: int | None, number: int) -> str:
    """The text before the number of the frame, in the last part of the path that has some; else the name of the folder."""
    if field is None:  # a pattern, or a file without a number
        field = max((at for at, value in enumerate(first.numbers) if value == number), default=None)
    before = first.text if field is None else first.text[: _start(first, field)]
    prefix = before.rpartition("/")[2].strip(" _-.")
    return prefix or first.path.resolve().parents[first.text.count("/")].name


def _start(name: NumberedName, field: int) -> int:
    """Where a number begins in the text."""
    return sum(len(text) for text in name.between[: field + 1]) + sum(len(digits) for digits in name.digits[:field])


def _gaps_and_step(numbers: list[int]) -> tuple[tuple[int, ...], int]:
    if len(numbers) == 1:
        return (), 1
    step = math.gcd(*(after - before for before, after in pairwise(numbers)))
    missing = (numbers[-1] - numbers[0]) // step + 1 - len(numbers)
    if missing > MAX_GAPS_PER_FRAME * len(numbers):
        return (), 0
    present = set(numbers)
    return tuple(number for number in range(numbers[0], numbers[-1], step) if number not in present), step


def _chosen(sequence: Sequence, ranges: tuple[FrameRange, ...]) -> Sequence:
    present = set(sequence.numbers)
    for number in (end for item in ranges for end in (item.first, item.last)):
        if number not in present:
            present_ranges = format_ranges(sequence.numbers)
            raise RefMeshError(f"--frames names frame {number}, which is missing: '{sequence.name}' has {present_ranges}")
    frames = tuple(frame for frame in sequence.frames if any(frame.number in item for item in ranges))
    gaps = tuple(number for number in sequence.gaps if any(number in item for item in ranges))
    return replace(sequence, frames=frames, gaps=gaps)
