"""Vertex colours of the PLY files that `write_ply` writes, read in a millisecond."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.check import RefMeshError

END = b"end_header\n"
_ROW = np.dtype([("position", "<f8", 3), ("color", "u1", 4)])
_PROPERTIES = [b"property double x", b"property double y", b"property double z"]
_PROPERTIES += [b"property uchar red", b"property uchar green", b"property uchar blue", b"property uchar alpha"]
_VELOCITY = ("velocity", "<f4", 3)  # may follow


def read_colors(path: str | Path) -> np.ndarray:
    """(V, 4) uint8. Raises RefMeshError when the file is missing, cut off, or has no colours as `write_ply` writes them."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise RefMeshError(f"{path}: cannot be read ({error.strerror or error}); run Measure Distance again") from error
    head, _, body = data.partition(END)
    lines = head.splitlines()
    count = next((int(line.split()[-1]) for line in lines if line.startswith(b"element vertex ")), 0)
    row = np.dtype([*_ROW.descr, _VELOCITY]) if b"property float vx" in lines else _ROW
    if [line for line in lines if line.startswith(b"property ")][:7] != _PROPERTIES or len(body) < count * row.itemsize:
        raise RefMeshError(f"{path}: holds no colours; run Measure Distance first")
    return np.frombuffer(body, row, count)["color"]
