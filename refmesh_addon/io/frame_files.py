"""The mesh files that a folder, a file or a pattern may stand for."""

from __future__ import annotations

import glob
import os
import re
from pathlib import Path

from ..core.errors import RefMeshError
from .formats import FRAME_FORMATS
from .numbered_names import NumberedName

FRAME_MARK = re.compile("#+")  # the number of the frame in a pattern
_DIGIT = re.compile("[0-9]")


def meshes_in(folder: Path) -> list[Path]:
    """Files of FRAME_FORMATS in a folder, by name. Raises RefMeshError when it cannot be read."""
    try:
        return sorted(path for path in folder.iterdir() if _is_mesh(path))
    except OSError as error:
        raise RefMeshError(f"{folder}: the folder cannot be read ({error.strerror})") from error


def meshes_in_numbered_folders(folder: Path) -> list[Path]:
    """Meshes in the folders of a folder that have a number in their name, or, where they have none, in folders of these."""
    numbered = [below for below in _folders(folder) if _DIGIT.search(below.name)]
    direct = [path for below in numbered for path in _readable(below)]
    return direct or [path for below in numbered for deeper in _folders(below) for path in _readable(deeper)]


def meshes_in_sibling_folders(path: Path) -> list[Path]:
    """Meshes in the folder of a file and in those beside it, where its name holds a number; [] where it holds none."""
    folder = path.absolute().parent
    return [file for below in _folders(folder.parent) for file in _readable(below)] if _DIGIT.search(folder.name) else []


def files_matching(pattern: str) -> tuple[list[NumberedName], list[int]] | None:
    """The meshes that a pattern stands for, and the number of each where it marks the frame with "#"; None if it is not a pattern."""
    marked = FRAME_MARK.search(pattern) is not None
    if not marked and not glob.has_magic(pattern):
        return None
    paths = [Path(name) for name in sorted(glob.glob(FRAME_MARK.sub("*", pattern), recursive=True))]
    meshes = [path for path in paths if _is_mesh(path)]
    if not marked:
        return named(meshes), []
    expression = _expression(pattern)
    matches = [(path, expression.fullmatch(path.as_posix())) for path in meshes]
    numbered = [(path, int(match[1])) for path, match in matches if match and len(match[1]) < 20]
    return named([path for path, _ in numbered]), [number for _, number in numbered]


def named(files: list[Path]) -> list[NumberedName]:
    """Each file with its path below the folder that all share."""
    if not files:
        return []
    shared = os.path.commonpath([path.parent for path in files])
    return [NumberedName(path, path.relative_to(shared).with_suffix("").as_posix()) for path in files]


def _expression(pattern: str) -> re.Pattern[str]:
    """A pattern with "#" as a regular expression; its first group is the number of the frame."""
    text = Path(pattern).as_posix()
    parts = [
        re.escape(part).replace(r"\*\*/", "(?:.*/)?").replace(r"\*", "[^/]*").replace(r"\?", "[^/]") for part in FRAME_MARK.split(text)
    ]
    return re.compile("(-?[0-9]+)".join(parts[:2]) + "".join(rf"-?[0-9]+{part}" for part in parts[2:]))


def _is_mesh(path: Path) -> bool:
    # macOS leaves "._name.obj" files beside the real ones on foreign disks.
    return path.suffix.lower() in FRAME_FORMATS and not path.name.startswith(".") and path.is_file()


def _folders(folder: Path) -> list[Path]:
    try:
        return sorted(path for path in folder.iterdir() if path.is_dir() and not path.name.startswith("."))
    except OSError:  # a folder beside the frames that may not be read holds none of them
        return []


def _readable(folder: Path) -> list[Path]:
    try:
        return meshes_in(folder)
    except RefMeshError:
        return []
