"""Which files and folders exports have written outside the output folder: others that are in their way are renamed, never replaced."""

from __future__ import annotations

from contextlib import suppress
from itertools import count
from pathlib import Path

from ...core.errors import RefMeshError
from ...io.files import output_folder, write_json
from ...io.regular_files import read_json
from .job import CACHE_FOLDER

RECORD_NAME = "exported.json"  # in the cache folder: paths that exports of these results have written
EXPORT_FOLDER = "export"  # in the output folder: where exports go unless another folder is chosen; all of it is RefMesh's


class ExportedFiles:
    """The exports of the results in one output folder.  kept : new path of each file or folder that was renamed."""

    def __init__(self, results: Path):
        self._results = results
        self._written = _recorded(results)
        self.kept: list[Path] = []

    def make_way(self, path: Path) -> None:
        """Renames what lies where an export is about to write, unless an earlier export wrote it, and records the path.

        Raises RefMeshError, naming the file, when it cannot be renamed.
        """
        name = str(path)
        if name in self._written or path.is_relative_to(self._results / EXPORT_FOLDER):
            return
        if path.exists() or path.is_symlink():
            self.kept.append(_renamed(path))
        self._written.add(name)
        with suppress(RefMeshError):  # of results that are read only: the next export keeps what this one writes
            write_json(output_folder(self._results / CACHE_FOLDER) / RECORD_NAME, sorted(self._written))


def _renamed(path: Path) -> Path:
    kept = next(free for number in count(1) if not (free := path.with_name(f"{path.stem}_kept_{number}{path.suffix}")).exists())
    try:
        return path.rename(kept)
    except OSError as error:
        reason = error.strerror or error
        raise RefMeshError(f"{path}: no export wrote it, and it cannot be renamed ({reason}); move it away") from error


def _recorded(results: Path) -> set[str]:
    try:
        record = read_json(results / CACHE_FOLDER / RECORD_NAME)
    except (OSError, ValueError):
        return set()
    return {name for name in record if isinstance(name, str)} if isinstance(record, list) else set()
