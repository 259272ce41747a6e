"""The takes of a batch: rows of a CSV file, or the folders in a folder, each with options of its own."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath

INPUT, OUTPUT = "input", "output"  # columns with a meaning of their own; all others are options without their dashes
PATH_OPTIONS = ("mesh",)  # relative to the file that names them
SWITCHES = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}
WILDCARDS = "*?[#"
DELIMITERS = ",;\t"  # programs for tables write the second one in many countries


class BatchError(Exception):
    """Why a batch cannot begin, in one line."""


@dataclass(frozen=True)
class Take:
    """One job: its input, its output folder, and its own options."""

    source: str
    output: Path
    options: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """For a person: the name of the output folder."""
        return self.output.name


@dataclass(frozen=True)
class Columns:
    """switches : options that are on or off.  others : options with a value.  is_scene : whether a path is one that holds a scene."""

    switches: frozenset[str]
    others: frozenset[str]
    is_scene: Callable[[str], bool]


def read_takes(batch: Path, output: Path, columns: Columns) -> list[Take]:
    """The takes of a CSV file or a folder. Raises BatchError when there are none, or two of them have one output folder."""
    try:
        takes = list(_folders(batch, output, columns) if batch.is_dir() else _rows(batch, output, columns))
    except FileNotFoundError as error:
        raise BatchError(f"{batch}: no such file or folder; give a CSV file, or a folder with a folder for each take") from error
    except OSError as error:
        raise BatchError(f"{batch}: cannot be read ({error.strerror or error})") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise BatchError(f"{batch}: cannot be read as CSV ({error}); save it as CSV in UTF-8") from error
    if not takes:
        raise BatchError(f"{batch}: holds no takes; give a folder with a folder for each take, or a CSV file with the column '{INPUT}'")
    places: dict[str, Take] = {}
    for take in takes:
        other = places.setdefault(os.path.normcase(os.path.realpath(take.output)), take)
        if other is not take:
            raise BatchError(f"{batch}: {other.source} and {take.source} would share {take.output}; give one another '{OUTPUT}'")
    return takes


def _folders(folder: Path, output: Path, columns: Columns) -> Iterator[Take]:
    """The folders and scene files in a folder, in the order of their names."""
    for path in sorted(path for path in folder.iterdir() if not path.name.startswith(".")):
        if path.is_dir() or columns.is_scene(str(path)):
            yield Take(str(path), output / _default_name(str(path), columns))


def _rows(path: Path, output: Path, columns: Columns) -> Iterator[Take]:
    text = path.read_text(encoding="utf-8-sig")
    first = text.split("\n", 1)[0]
    table = csv.DictReader(io.StringIO(text, newline=""), delimiter=max(DELIMITERS, key=first.count), skipinitialspace=True)
    _check_columns(path, table.fieldnames or (), columns)
    for row in table:
        if None in row:
            raise BatchError(f"{path}, line {table.line_num}: more cells than columns; put text that contains the separator in quotes")
        cells = {_option(name): (text or "").strip() for name, text in row.items()}
        if any(cells.values()):
            yield _take(f"{path}, line {table.line_num}", cells, path.parent, output, columns)


def _check_columns(path: Path, names: Sequence[str], columns: Columns) -> None:
    options = [_option(name) for name in names]
    if INPUT not in options:
        raise BatchError(f"{path}: has no column '{INPUT}'; its first line names the columns, as in '{INPUT},preset,export'")
    for option in options:
        if option not in {INPUT, OUTPUT} | columns.switches | columns.others:
            raise BatchError(f"{path}: the column '{option}' is not an option of a take; --help lists the options")
    if len(set(options)) < len(options):
        raise BatchError(f"{path}: the column '{next(name for name in options if options.count(name) > 1)}' appears twice; remove one")


def _take(place: str, cells: dict[str, str], folder: Path, output: Path, columns: Columns) -> Take:
    if not cells[INPUT]:
        raise BatchError(f"{place}: '{INPUT}' is empty; name a take there")
    source = os.path.join(folder, cells[INPUT])
    cells = {name: text for name, text in cells.items() if text}
    place_of = cells.pop(OUTPUT, "") or _default_name(source, columns)
    del cells[INPUT]
    options = [option for name, text in cells.items() for option in _options(place, name, text, folder, columns)]
    return Take(source, output / place_of, tuple(options))


def _options(place: str, option: str, text: str, folder: Path, columns: Columns) -> list[str]:
    """What one cell is on the command line."""
    if option in columns.switches:
        if text.lower() not in SWITCHES:
            raise BatchError(f"{place}: '{option}' is '{text}'; write yes or no")
        return [f"--{option}" if SWITCHES[text.lower()] else f"--no-{option}"]
    if option == "export":
        return [f"--export={kind}" for kind in text.split()]
    return [f"--{option}={os.path.join(folder, text) if option in PATH_OPTIONS else text}"]


def _option(column: str) -> str:
    return column.strip().lower().lstrip("-").replace("_", "-")


def _default_name(source: str, columns: Columns) -> str:
    """The folder's name, also where one of its files or a pattern is given; that of a scene file itself."""
    path = PurePath(source)
    if columns.is_scene(source):
        return path.stem
    if os.path.isdir(source):
        return os.path.basename(os.path.abspath(source))
    path = path.parent
    while set(path.name) & set(WILDCARDS):
        path = path.parent
    return os.path.basename(os.path.abspath(path))
