"""Reads .npz files that may be damaged, or made to fill the memory: what they declare is held against their size before it is read."""

from __future__ import annotations

import io
import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterable
from functools import lru_cache
from typing import BinaryIO

import numpy as np

_HEADER_START = 10  # bytes of an .npy before its header: magic, version, length of the header, two bytes
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
    length = _HEADER_START + int.from_bytes(data[_HEADER_START - 2 : _HEADER_START], "little")
    shape, by_columns, dtype = _layout(data[:length])
    if dtype.hasobject or not dtype.itemsize:
        raise ValueError(f"an array of {dtype} is no array of RefMesh's")
    if math.prod(shape) * dtype.itemsize != len(data) - length:
        raise ValueError("an array declares more or less than it holds")
    values = np.frombuffer(data, dtype, offset=length) if len(data) > length else np.zeros(0, dtype)
    return values.copy().reshape(shape, order="F" if by_columns else "C")


@lru_cache(maxsize=1024)
def _layout(header: bytes) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Shape, whether columns come first, and type. Cached: NumPy takes longer to parse the header of a small array than to read it."""
    file = io.BytesIO(header)
    if np.lib.format.read_magic(file) != (1, 0):
        raise ValueError("an array in a format that RefMesh never writes")
    shape, by_columns, dtype = np.lib.format.read_array_header_1_0(file)
    if min(shape, default=0) < 0:
        raise ValueError(f"an array of shape {shape}")
    return shape, by_columns, dtype
