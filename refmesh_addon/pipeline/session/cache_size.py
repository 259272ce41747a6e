"""How much the cache of an output folder takes, and how to get that back."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from ...core.errors import RefMeshError
from .cache import KEY_LENGTH
from .job import CACHE_FOLDER

_ENTRY = re.compile(rf".+-[0-9a-f]{{{KEY_LENGTH}}}\.npz")
PREVIEW_FOLDER = "preview"  # in the cache: what Blender shows of the source, also without the rest


def cache_size(output: str | Path) -> int:
    """Bytes of the entries that `clean_cache` removes, as far as nothing else needs them."""
    return sum(size for _, size in _entries(Path(output)))


def clean_cache(output: str | Path) -> int:
    """Removes the results of stages that are only there for the next run, and returns how many bytes that gives back.

    The list of written files, records of textures and the preview of the source stay. The next run computes everything again.
    Raises RefMeshError, naming the file, when one cannot be removed.
    """
    freed = 0
    for path, size in _entries(Path(output)):
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise RefMeshError(f"{path}: cannot be removed ({error.strerror or error})") from error
        freed += size
    return freed


def _entries(output: Path) -> Iterator[tuple[Path, int]]:
    """Entries with their sizes; 0 for one that is also the preview of a frame, under another name."""
    cache = output / CACHE_FOLDER
    for folder, names, files in os.walk(cache):
        if Path(folder) == cache:
            names[:] = [name for name in names if name != PREVIEW_FOLDER]
        for name in sorted(files):
            if _ENTRY.fullmatch(name):
                path = Path(folder, name)
                state = path.lstat()
                yield path, state.st_size if state.st_nlink == 1 else 0
