"""Named arrays as .npz files that show any damage: a checksum over the whole file stands in the archive's comment.

NumPy stops reading an array before the archive's own checksum of it when the shape in its header is damaged, and nothing in the archive
protects the names. The comment is ignored by `numpy.load`, so these files are ordinary .npz files.
"""

from __future__ import annotations

import hashlib
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np

from .files import atomic_file
from .npz_reader import DAMAGE, described, loaded_arrays
from .regular_files import open_regular

_MARK = b"refmesh "
_DIGEST_BYTES = 16
_SEAL_LENGTH = len(_MARK) + 2 * _DIGEST_BYTES
_END_OF_ARCHIVE, _END_LENGTH = b"PK\5\6", 22  # the last record of a zip archive; its last two bytes are the length of the comment
_CHUNK = 1 << 20


def write_sealed(path: Path, name: str, arrays: Mapping[str, np.ndarray]) -> None:
    """Writes the arrays; the same arrays and name give the same bytes. name : what the file is for, which the checksum includes.

    Raises RefMeshError when the file cannot be written.
    """
    with atomic_file(path) as file:
        np.savez(file, **arrays)
        seal(file, name)


def seal(file: BinaryIO, name: str) -> None:
    """Adds the checksum to an archive without a comment."""
    file.seek(-2, 2)
    file.write(struct.pack("<H", _SEAL_LENGTH))
    length = file.tell()
    file.write(_seal(file, length, name))


def read_sealed(path: Path, name: str) -> dict[str, np.ndarray]:
    """The arrays of a file. Raises FileNotFoundError when there is none, and ValueError when it is damaged or was written for another name.

    Files of earlier versions, which have no comment, are held against the archive's checksums of all their members.
    """
    try:
        with open_regular(path) as file:
            _check(file, name)
            return loaded_arrays(file)
    except FileNotFoundError:
        raise
    except DAMAGE as error:
        raise ValueError(f"damaged ({described(error)})") from error


def _check(file: BinaryIO, name: str) -> None:
    size = file.seek(0, 2)
    file.seek(max(size - _SEAL_LENGTH, 0))
    tail = file.read()
    if tail.startswith(_MARK):
        if tail != _seal(file, size - _SEAL_LENGTH, name):
            raise ValueError("the checksum differs")
        return
    if tail[-_END_LENGTH:][:4] != _END_OF_ARCHIVE or tail[-2:] != b"\0\0":
        raise ValueError("the archive has no end")
    with zipfile.ZipFile(file) as archive:
        damaged = archive.testzip()
    if damaged:
        raise ValueError(f"the checksum of {damaged} differs")


def _seal(file: BinaryIO, length: int, name: str) -> bytes:
    """The comment for the first `length` bytes of the file, at the end of which the file then stands."""
    total = hashlib.blake2b(name.encode("utf-8"), digest_size=_DIGEST_BYTES)
    file.seek(0)
    for start in range(0, length, _CHUNK):
        total.update(file.read(min(_CHUNK, length - start)))
    return _MARK + total.hexdigest().encode("ascii")
