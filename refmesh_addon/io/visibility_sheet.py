"""The visibility of all vertices of a group in all of its frames as one gray picture, which Geometry Nodes look values up in.

Frame after frame from the top, each in whole rows of WIDTH pixels, vertex after vertex. Written row by row, as PNG by zlib alone: a long
take does not fit in memory, and the pipeline must not need a package for it.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from .files import atomic_file
from .png_chunks import GRAY, UNFILTERED, chunk, header

WIDTH = 4096  # pixels: a body of 15,000 vertices has four rows a frame, so that 1000 frames stay far below what pictures may have
DEPTH = 8  # bits of a pixel


def rows_per_frame(vertices: int) -> int:
    """Rows of the picture that the vertices of one frame take."""
    return -(-vertices // WIDTH)


def write_visibility(path: str | Path, frames: Iterable[np.ndarray], vertices: int, count: int) -> None:
    """Writes `count` frames of (vertices,) values from 0 to 1, in 256 steps; `frames` is read one at a time.

    Raises RefMeshError when the file cannot be written, ValueError when the frames are not as declared.
    """
    rows = rows_per_frame(vertices)
    packer, written = zlib.compressobj(), 0
    with atomic_file(path) as file:
        file.write(header(WIDTH, rows * count, DEPTH, GRAY))
        for values in frames:
            if values.shape != (vertices,):
                raise ValueError(f"frame {written} must be ({vertices},); got {values.shape}")
            pixels = np.zeros(rows * WIDTH, dtype=np.uint8)
            pixels[:vertices] = np.rint(255 * np.clip(values, 0.0, 1.0))
            lines = b"".join(UNFILTERED + line.tobytes() for line in pixels.reshape(rows, WIDTH))
            file.write(chunk(b"IDAT", packer.compress(lines)))
            written += 1
        if written != count:
            raise ValueError(f"count is {count}, but {written} frames were given")
        file.write(chunk(b"IDAT", packer.flush()) + chunk(b"IEND", b""))
