"""Discovers the frames of a mesh sequence by their file names; never opens a mesh.

The number of a frame is the last run of digits in its name, or the last run in which the names differ
(`take_0001_lod2.obj` and `take_0002_lod2.obj` differ in the first). Padding, prefix, first number and gaps do not matter.
"""

from __future__ import annotations

import glob
import math
import re
from collections import Counter
from itertools import pairwise
from pathlib import Path

from ..core.errors import RefMeshError
from .formats import FRAME_FORMATS, frame_format
from .frame_range import FrameRange, format_ranges, parse_ranges
from .sequence import Frame, Sequence

# More missing numbers than this for each file: the numbers are time stamps (milliseconds, say), not a count of frames.
MAX_GAPS_PER_FRAME = 10
MAX_DIGITS = 18  # of a number that still fits into a 64-bit integer
CANDIDATES_SHOWN = 4  # sequences that a message lists


def find_sequence(source: str | Path, frames: str = "") -> Sequence:
    """The sequence that `source` names: a folder, one file of a sequence, or a glob pattern.

    A folder gives the meshes of its most frequent extension. A file gives all files whose names differ from its own in
    the number only; a file without a number is a sequence of one frame, number 1.
    `frames` chooses by number, ends included: "6-10", "6-10,14"; "" takes all.
    Raises RefMeshError when there is no such sequence, when there are several, or when a chosen number does not exist.
    """
    ranges = parse_ranges(frames)
    sequence = _build(_series_of(str(source)))
    return _chosen(sequence, ranges) if ranges else sequence


_Series = dict[str, Path]  # the digits of each file's number -> the file


def _series_of(source: str) -> _Series:
    path = Path(source)
    if path.is_dir():
        return _only_series(_most_frequent_kind(_meshes_in(path)), source)
    if path.is_file():
        return _series_with(path)
    if glob.has_magic(source):
        files = [Path(name) for name in sorted(glob.glob(source, recursive=True))]
        return _only_series([file for file in files if _is_mesh(file)], source)
    raise RefMeshError(f"{source}: no such file or folder; give a folder, one file of a sequence, or a pattern such as 'scan_*.obj'")


def _is_mesh(path: Path) -> bool:
    # macOS leaves "._name.obj" files beside the real ones on foreign disks.
    return path.suffix.lower() in FRAME_FORMATS and not path.name.startswith(".") and path.is_file()


def _meshes_in(folder: Path) -> list[Path]:
    try:
        return sorted(path for path in folder.iterdir() if _is_mesh(path))
    except OSError as error:
        raise RefMeshError(f"{folder}: the folder cannot be read ({error.strerror})") from error


def _most_frequent_kind(files: list[Path]) -> list[Path]:
    counts = Counter(path.suffix.lower() for path in files)
    kind = max(FRAME_FORMATS, key=lambda extension: counts[extension])
    return [path for path in files if path.suffix.lower() == kind]


def _series_with(path: Path) -> _Series:
    frame_format(path)  # refuses what cannot be read
    siblings = [path] + [other for other in _meshes_in(path.parent) if other.name != path.name]
    for run in range(_digit_runs(path)):
        key = _split(path, run)[0]
        series = _group(siblings, run)[key]
        if len(series) > 1:
            return series
    return _single_frame(path)


def _only_series(files: list[Path], source: str) -> _Series:
    if not files:
        raise RefMeshError(f"{source}: no meshes found; expected files such as frame_0001.obj ({', '.join(FRAME_FORMATS)})")
    if len(files) == 1:
        return _single_frame(files[0])
    groups = _most_telling_groups(files)
    if not groups:
        raise RefMeshError(f"{source}: the names of its {len(files)} meshes carry no frame number; number them, as in frame_0001.obj")
    if len(groups) > 1:
        raise RefMeshError(f"{source}: several sequences found ({_candidates(groups)}); give one file of the one you mean")
    return next(iter(groups.values()))


def _most_telling_groups(files: list[Path]) -> dict[tuple, _Series]:
    """The files grouped by the last run of digits that tells several of them apart; by the last one where none does."""
    groups: dict[tuple, _Series] = {}
    for run in range(max(map(_digit_runs, files))):
        candidates = _group(files, run)
        groups = groups or candidates
        if any(len(series) > 1 for series in candidates.values()):
            return candidates
    return groups


def _candidates(groups: dict[tuple, _Series]) -> str:
    shown = [f"{next(iter(series.values())).name} and {len(series) - 1} more" for series in list(groups.values())[:CANDIDATES_SHOWN]]
    others = len(groups) - CANDIDATES_SHOWN
    return "; ".join(shown) + (f"; and {others} others" if others > 0 else "")


def _single_frame(path: Path) -> _Series:
    return {_split(path, 0)[1] if _digit_runs(path) else "1": path}


def _digit_runs(path: Path) -> int:
    return len(re.findall("[0-9]+", path.stem))


def _split(path: Path, run: int) -> tuple[tuple[str, str, str, str], str]:
    """What all names of the series share, and the digits; `run` counts runs of digits from the end of the name."""
    start, end = list(re.finditer("[0-9]+", path.stem))[-1 - run].span()
    shared = (str(path.parent), path.stem[:start], path.stem[end:], path.suffix.lower())
    return shared, path.stem[start:end]


def _group(files: list[Path], run: int) -> dict[tuple, _Series]:
    groups: dict[tuple, _Series] = {}
    for path in files:
        if run < _digit_runs(path):
            key, digits = _split(path, run)
            groups.setdefault(key, {})[digits] = path
    return groups


def _build(series: _Series) -> Sequence:
    by_number: dict[int, Path] = {}
    for digits, path in series.items():
        number = int(digits)
        if len(digits.lstrip("0")) > MAX_DIGITS:
            raise RefMeshError(f"{path}: the frame number has more than {MAX_DIGITS} digits; rename the files")
        if number in by_number:
            raise RefMeshError(f"{path.parent}: {by_number[number].name} and {path.name} are both frame {number}; remove one of them")
        by_number[number] = path
    numbers = sorted(by_number)
    gaps, step = _gaps_and_step(numbers)
    return Sequence(_name(series), tuple(Frame(number, by_number[number]) for number in numbers), gaps, step)


def _name(series: _Series) -> str:
    digits, path = next(iter(series.items()))
    prefix = path.stem[: path.stem.rindex(digits)] if digits in path.stem else path.stem
    return prefix.strip(" _-.") or path.resolve().parent.name


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
    return Sequence(sequence.name, frames, gaps, sequence.step)
