"""PNG files with three channels of 16 bits, which Pillow cannot write (PNG specification, third edition, sections 5 and 11)."""

from __future__ import annotations

import struct
import zlib

import numpy as np

SIGNATURE = b"\x89PNG\r\n\x1a\n"
DEPTH, TRUECOLOR = 16, 2
EFFORT = 9  # of zlib
UNFILTERED = b"\0"  # before each row


def encoded_png(pixels: np.ndarray) -> bytes:
    """(H, W, 3) uint16, first row at the top; the same pixels give the same bytes."""
    height, width, channels = pixels.shape
    if pixels.dtype != np.uint16 or channels != 3:
        raise ValueError(f"pixels must be (H, W, 3) uint16; got {pixels.shape} {pixels.dtype}")
    rows = b"".join(UNFILTERED + row.tobytes() for row in pixels.astype(">u2"))
    head = struct.pack(">IIBBBBB", width, height, DEPTH, TRUECOLOR, 0, 0, 0)
    return SIGNATURE + _chunk(b"IHDR", head) + _chunk(b"IDAT", zlib.compress(rows, EFFORT)) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
