"""Which files in an output folder RefMesh has written: it replaces and removes no others."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from ...core.errors import RefMeshError
from ...io.files import CENTERS_NAME, WRITTEN_LIST, atomic_file, output_folder
from ...io.findings import CHECK_NAME, CHECK_TEXT, read_findings
from ...io.regular_files import read_regular
from ...io.report import REPORT_NAME, read_report
from ...io.report_schema import PATHS

# Names that only RefMesh gives, for folders that were written before there was a list or have lost theirs.
_OWN_NAME = re.compile(
    r"deformed/frame_-?\d+\.ply|reference/group_\d{3,}\.ply|playback/(centers|group_\d{3,})-[0-9a-f]{12}\.pc2|colored/frame_-?\d+\.ply"
    r"|texture/(group_\d{3,}_(layout\.npz|steady(_mask)?\.png)|(frame|mask)_-?\d+\.\w+)"
)


class WrittenFiles:
    """The list of files that the runs in an output folder have written.

    A name is listed before its file is written, so that a killed run leaves no file that the next one would take for the user's.
    Where the list is missing, as in folders of earlier versions, RefMesh's own file names are replaced if a report of RefMesh's is
    there, and only what that report names is removed.
    """

    def __init__(self, output: Path):
        self._output = output
        self._list = output / WRITTEN_LIST
        output_folder(self._list.parent)
        self._names: set[str] = set()
        self._unlisted = False
        try:
            self._names.update(read_regular(self._list).decode("utf-8").splitlines())
        except (OSError, UnicodeDecodeError):
            self._names.update(_reported(output))
            self._unlisted = bool(self._names)
        self._save()

    def claim(self, name: str) -> Path:
        """The path of a result that is about to be written, by its name relative to the output folder.

        Raises RefMeshError when a file is there that RefMesh has not written.
        """
        path = self._output / name
        if name not in self._names:
            own = self._unlisted and _OWN_NAME.fullmatch(name)
            if not own and (path.exists() or path.is_symlink()):
                raise RefMeshError(
                    f"{path}: is not a file that RefMesh wrote, so it is kept; move it or choose another output folder"
                )
            self._add(name)
        return path

    def remove_stale(self, pattern: str, keep: Iterable[str]) -> None:
        """Removes listed files that match the pattern and are not among those to keep, all relative to the output folder."""
        matching = {path.relative_to(self._output).as_posix() for path in self._output.glob(pattern)}
        stale = (matching & self._names) - set(keep)
        for name in stale:
            self._remove(self._output / name)
        if stale:
            self._names -= stale
            self._save()

    def _remove(self, path: Path) -> None:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise RefMeshError(f"{path}: is out of date and cannot be removed ({error.strerror or error}); remove it") from error

    def _add(self, name: str) -> None:
        self._names.add(name)
        try:
            with open(self._list, "a", encoding="utf-8") as file:
                file.write(f"{name}\n")
        except OSError as error:
            raise RefMeshError(f"{self._list}: cannot be written ({error.strerror or error})") from error

    def _save(self) -> None:
        with atomic_file(self._list) as file:
            file.write("".join(f"{name}\n" for name in sorted(self._names)).encode("utf-8"))


def _reported(output: Path) -> Iterator[str]:
    """Names of the files that an earlier check and the report of an earlier run stand for."""
    try:
        read_findings(output)
        yield from (CHECK_NAME, CHECK_TEXT)
    except RefMeshError:
        pass
    try:
        report = read_report(output)
    except RefMeshError:
        return
    yield from (REPORT_NAME, CENTERS_NAME)
    for entry in (report, *report["groups"], *report["frames"]):
        yield from (entry[key] for key in PATHS if isinstance(entry.get(key), str))
