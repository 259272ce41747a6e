"""PNG files with three channels of 16 bits, which Pillow cannot write (PNG specification, third edition, section 11)."""

from __future__ import annotations

import zlib

import numpy as np

from ..png_chunks import TRUECOLOR, UNFILTERED, chunk, header

DEPTH = 16  # bits of a channel
EFFORT = 9  # of zlib


def encoded_png(pixels: np.ndarray) -> bytes:
    """The file for (H, W, 3) uint16 pixels, first row at the top; the same pixels give the same bytes.

    Raises ValueError for pixels of another shape or type.
    """
    height, width, channels = pixels.shape
    if pixels.dtype != np.uint16 or channels != 3:
        raise ValueError(f"pixels must be (H, W, 3) uint16; got {pixels.shape} {pixels.dtype}")
    rows = b"".join(UNFILTERED + row.tobytes() for row in pixels.astype(">u2"))
    return header(width, height, DEPTH, TRUECOLOR) + chunk(b"IDAT", zlib.compress(rows, EFFORT)) + chunk(b"IEND", b"")
