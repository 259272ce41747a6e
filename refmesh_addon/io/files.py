"""Files that are complete or absent: everything is written beside its target, which it replaces once it is complete."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..core.errors import RefMeshError
from .npz_reader import loaded_arrays
from .regular_files import open_regular

CENTERS_NAME = "centers.npz"  # in the output folder: the result of tracking
WRITTEN_LIST = "cache/written.txt"  # in every output folder: a line for each file that runs have written there, relative to it
PARTIAL_SUFFIX = ".refmesh-partial"  # of a file that is still being written; what a killed run leaves is removed by the next


@contextmanager
def atomic_file(path: str | Path) -> Iterator[BinaryIO]:
    """A binary file to write to, which replaces `path` when the block succeeds and is removed when it fails.

    Raises RefMeshError, naming the file, when it cannot be written (no permission, disk full).
    """
    path = Path(path)
    partial = path.with_name(path.name + PARTIAL_SUFFIX)
    try:
        partial.unlink(missing_ok=True)
        with open(partial, "x+b") as file:  # a new file: opening what lies there could follow a link
            yield file
            file.flush()
            os.fsync(file.fileno())  # or a power cut could leave an empty file under the final name
        os.replace(partial, path)
    except BaseException as error:
        remove_if_possible(partial)
        if isinstance(error, OSError):
            raise RefMeshError(f"{path}: cannot be written ({error.strerror or error})") from error
        raise


def output_folder(path: str | Path, shared: bool = False) -> Path:
    """Creates the folder and its parents where missing; removes partial files that a killed run left in it.

    shared : others may be writing there now, so partial files are left.
    Raises RefMeshError, naming the folder, when it cannot be created or written to.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        # Those of Blender's own exporters keep their extension.
        for partial in () if shared else (*path.glob("*" + PARTIAL_SUFFIX), *path.glob(f"*{PARTIAL_SUFFIX}.*")):
            if not partial.is_dir():
                partial.unlink()
        probe = path / (f"write-test-{os.getpid()}" + PARTIAL_SUFFIX)
        probe.unlink(missing_ok=True)  # writing would follow a link
        probe.write_bytes(b"")
        probe.unlink(missing_ok=True)
    except OSError as error:
        raise RefMeshError(f"{path}: the output folder cannot be written to ({error.strerror or error}); choose another") from error
    return path


def remove_if_possible(path: Path) -> None:
    """Removes a file that nobody needs; what cannot be removed, such as a folder in its place, stays."""
    with suppress(OSError):
        path.unlink(missing_ok=True)


def write_npz(path: str | Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Named arrays as an .npz; the same arrays give the same bytes (numpy stamps its entries 1980)."""
    with atomic_file(path) as file:
        np.savez(file, **arrays)


def read_npz(path: str | Path) -> dict[str, np.ndarray]:
    """The arrays of an .npz, all in memory.

    Raises FileNotFoundError when there is none, and ValueError when it is damaged or holds what `write_npz` does not write.
    """
    with open_regular(path) as file:
        return loaded_arrays(file)


def write_json(path: str | Path, data: object) -> None:
    """Indented UTF-8 JSON in the order given; numpy numbers and arrays are allowed. Raises ValueError for NaN or infinity."""
    text = json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False, default=_plain)
    with atomic_file(path) as file:
        file.write(text.encode("utf-8") + b"\n")


def _plain(value: object) -> object:
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"{type(value).__name__} cannot be written as JSON")
