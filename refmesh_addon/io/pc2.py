"""PC2 point caches, which Blender's Mesh Cache modifier plays."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from ..core.errors import RefMeshError
from .files import atomic_file
from .regular_files import open_regular

_HEADER = struct.Struct("<12siiffi")  # magic, version, points, first frame, sample rate, samples
_MAGIC, _VERSION, _START, _RATE = b"POINTCACHE2\0", 1, 0.0, 1.0


def write_pc2(path: str | Path, samples: Iterable[np.ndarray], points: int, count: int, offset: np.ndarray | float = 0.0) -> None:
    """Writes one sample for each scene frame; `samples` is consumed one at a time, so that only one is in memory.

    samples : `count` arrays, each (points, 3), scene units; stored as float32.
    offset : (3,) that is subtracted from them before, as single precision is too coarse far from the origin.
    Raises RefMeshError when the file cannot be written, ValueError when the samples are not as declared.
    """
    with atomic_file(path) as file:
        file.write(_HEADER.pack(_MAGIC, _VERSION, points, _START, _RATE, count))
        written = 0
        for sample in samples:
            if sample.shape != (points, 3):
                raise ValueError(f"sample {written} must be ({points}, 3); got {sample.shape}")
            file.write(np.ascontiguousarray(sample - offset, dtype="<f4").tobytes())
            written += 1
        if written != count:
            raise ValueError(f"count is {count}, but {written} samples were given")


def pc2_shape(path: str | Path) -> tuple[int, int]:
    """(samples, points) from the header of the file. Raises RefMeshError when it is missing, truncated or not a PC2 file."""
    path = Path(path)
    try:
        with open_regular(path) as file:
            head = file.read(_HEADER.size)
        size = path.stat().st_size
    except OSError as error:
        raise RefMeshError(f"{path}: cannot be read ({error.strerror or error})") from error
    if len(head) < _HEADER.size or not head.startswith(_MAGIC):
        raise RefMeshError(f"{path}: is not a PC2 point cache")
    _, _, points, _, _, count = _HEADER.unpack(head)
    if points < 0 or count < 0 or size != _HEADER.size + 12 * points * count:
        raise RefMeshError(f"{path}: the point cache is truncated; run the step again")
    return count, points


def read_pc2(path: str | Path) -> Iterator[np.ndarray]:
    """The samples one after the other, each (points, 3) float32. Raises RefMeshError as `pc2_shape` does."""
    count, points = pc2_shape(path)
    with open_regular(path) as file:
        file.seek(_HEADER.size)
        for _ in range(count):
            yield np.frombuffer(file.read(12 * points), dtype="<f4").reshape(points, 3)
