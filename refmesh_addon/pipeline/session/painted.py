"""Steady textures that the user has painted on since RefMesh wrote them: they are renamed, never replaced or removed."""

from __future__ import annotations

import re
from hashlib import sha256
from itertools import count
from pathlib import Path

from ...io.files import write_json
from ...io.regular_files import read_json, read_regular
from ...io.report import TEXTURE_FOLDER
from .job import CACHE_FOLDER

_NAME = re.compile(rf"{TEXTURE_FOLDER}/group_\d{{3,}}_steady\.png")
RECORD_NAME = "steady_textures.json"  # in the cache folder: digests of each texture as runs have written it


def record_texture(output: Path, name: str, data: bytes) -> None:
    """Adds what is about to be written, so that a run killed before or after it leaves no file that looks painted."""
    record = _recorded(output)
    known, digest = record.get(name, []), sha256(data).hexdigest()
    if digest not in known:
        write_json(output / CACHE_FOLDER / RECORD_NAME, {**record, name: [*known, digest]})


def rename_painted(output: Path) -> dict[str, str]:
    """Renames every recorded file that has changed since; returns its new name for each. Without a record, nothing is known."""
    renamed = {}
    for name, known in _recorded(output).items():
        path = output / name
        if path.is_file() and sha256(read_regular(path)).hexdigest() not in known:
            free = next(path.with_name(f"{path.stem}_painted_{number}.png") for number in count(1) if not _taken(path, number))
            path.rename(free)
            renamed[name] = free.relative_to(output).as_posix()
    return renamed


def _taken(path: Path, number: int) -> bool:
    return path.with_name(f"{path.stem}_painted_{number}.png").exists()


def _recorded(output: Path) -> dict[str, list[str]]:
    """Only what a run can have recorded: a record from elsewhere could name any file of the user's."""
    try:
        record = read_json(output / CACHE_FOLDER / RECORD_NAME)
    except (OSError, ValueError):
        return {}
    if not isinstance(record, dict):
        return {}
    return {name: known for name, known in record.items() if _NAME.fullmatch(name) and isinstance(known, list)}
