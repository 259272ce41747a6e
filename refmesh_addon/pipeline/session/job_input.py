"""The input of a job, kept apart from its output."""

from __future__ import annotations

import os
from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from pathlib import Path

from ...core.errors import RefMeshError
from ...io.discovery import find_sequence
from ...io.report import COLORED_FOLDER, DEFORMED_FOLDER
from ...io.sequence import BAKED_FOLDER, Sequence
from .job import JobSpec

_MESH_FOLDERS = ("reference", DEFORMED_FOLDER, COLORED_FOLDER)  # in the output folder, of results that are meshes
_Identity = tuple[int, int]  # device and inode: the same for every name of a folder


def job_sequence(spec: JobSpec) -> Sequence:
    """The sequence that a job reads.

    Raises RefMeshError when there is none, and when the output folder holds one of its frames, or the user's mesh lies among the results.
    """
    sequence = find_sequence(spec.source, spec.frames)
    check_apart(sequence, spec.output)
    _check_own_mesh(spec.settings.reference.mesh, Path(spec.output))
    return sequence


def _check_own_mesh(mesh: str, output: Path) -> None:
    if mesh and _lies_in(Path(os.path.realpath(mesh)).parent, {_identity(output / folder) for folder in _MESH_FOLDERS} - {None}, None):
        raise RefMeshError(f"{mesh}: lies among the results, which would replace it; copy it to another folder and give that copy")


def check_apart(sequence: Sequence, output: str | Path) -> None:
    """Raises RefMeshError, naming the file, when a frame lies in the output folder, or in a folder that is linked into it.

    Folders are compared by what they are, not by their names: links, other spellings and other letter cases do not matter.
    """
    output = Path(output)
    if not os.path.isdir(output):
        return
    try:
        folders = [entry.path for entry in os.scandir(output) if entry.is_dir()]
    except OSError as error:
        raise RefMeshError(f"{output}: the output folder cannot be read ({error.strerror or error}); choose another") from error
    written = {_identity(output), *map(_identity, folders)} - {None}
    baked = _identity(output / BAKED_FOLDER)
    inside: dict[Path, bool] = {}
    for frame in sequence.frames:
        for folder in (frame.path.absolute().parent, Path(os.path.realpath(frame.path)).parent):
            if folder not in inside:
                inside[folder] = _lies_in(folder, written, baked)
            if inside[folder]:
                raise RefMeshError(
                    f"{output}: the output folder holds the input ({frame.path}), which results could replace; choose another output folder"
                )


def _lies_in(folder: Path, written: AbstractSet[_Identity | None], baked: _Identity | None) -> bool:
    for identity in _ancestors(folder):
        if identity is not None and identity == baked:
            return False
        if identity in written:
            return True
    return False


def _ancestors(folder: Path) -> Iterator[_Identity | None]:
    """Of the folder itself and all around it, with links resolved."""
    real = Path(os.path.realpath(folder))
    return (_identity(path) for path in (real, *real.parents))


def _identity(folder: str | Path) -> _Identity | None:
    try:
        status = os.stat(folder)
    except OSError:
        return None
    return status.st_dev, status.st_ino
