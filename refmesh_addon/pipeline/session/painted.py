"""Steady textures that the user has painted on since RefMesh wrote them: they are renamed, never replaced or removed."""

from __future__ import annotations

import json
from hashlib import sha256
from itertools import count
from pathlib import Path

from ...io.files import write_json
from .job import CACHE_FOLDER

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
        if path.is_file() and sha256(path.read_bytes()).hexdigest() not in known:
            free = next(path.with_name(f"{path.stem}_painted_{number}.png") for number in count(1) if not _taken(path, number))
            path.rename(free)
            renamed[name] = free.relative_to(output).as_posix()
    return renamed


def _taken(path: Path, number: int) -> bool:
    return path.with_name(f"{path.stem}_painted_{number}.png").exists()


def _recorded(output: Path) -> dict[str, list[str]]:
    try:
        record = json.loads((output / CACHE_FOLDER / RECORD_NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}
