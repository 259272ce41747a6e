"""What every PNG file is made of (PNG specification, third edition, section 5)."""

from __future__ import annotations

import struct
import zlib

SIGNATURE = b"\x89PNG\r\n\x1a\n"
UNFILTERED = b"\0"  # before each row of pixels
GRAY, TRUECOLOR = 0, 2


def header(width: int, height: int, depth: int, color: int) -> bytes:
    """Signature and first chunk.  width, height : pixels.  depth : bits of a channel.  color : GRAY or TRUECOLOR."""
    return SIGNATURE + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, color, 0, 0, 0))


def chunk(kind: bytes, data: bytes) -> bytes:
    """A chunk with its length and its checksum.  kind : four letters."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
