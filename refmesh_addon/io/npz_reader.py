"""Reads .npz files that may be damaged, or made to fill the memory: what they declare is held against their size before it is read."""

from __future__ import annotations

import io
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterable
from typing import BinaryIO

import numpy as np

# What numpy.load and zipfile raise for damaged files.
DAMAGE = (
    OSError,
    ArithmeticError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


def loaded_arrays(file: BinaryIO, names: Iterable[str] | None = None) -> dict[str, np.ndarray]:
    """The arrays of an .npz, or those of some names. Raises ValueError when it is damaged, compressed or declares more than it holds.

    Every byte of a member is held against the archive's checksum of it. Memory stays below about twice the size of the file.
    """
    try:
        size = file.seek(0, 2)
        with zipfile.ZipFile(file) as archive:
            members = {member.filename.removesuffix(".npy"): member for member in archive.infolist()}
            _check_sizes(members.values(), size)
            return {name: _array(archive.read(members[name])) for name in (members if names is None else names)}
    except DAMAGE as error:
        raise ValueError(described(error)) from error


def described(error: Exception) -> str:
    """What is wrong with a file, by what was raised while it was read."""
    return str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"


def _check_sizes(members: Iterable[zipfile.ZipInfo], size: int) -> None:
    """A compressed member, or one that shares its bytes with others, could stand for a thousand times of what the file holds."""
    if any(member.compress_type != zipfile.ZIP_STORED for member in members):
        raise ValueError("it is compressed, which RefMesh never does")
    if sum(member.file_size for member in members) > size:
        raise ValueError("it declares more than it holds")


def _array(data: bytes) -> np.ndarray:
    file = io.BytesIO(data)
    array = np.lib.format.read_array(file, allow_pickle=False)
    if file.tell() != len(data):
        raise ValueError("an array declares less than it holds")
    return array
