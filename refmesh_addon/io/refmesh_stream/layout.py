"""Where what stands in a .refmesh file. All numbers are little-endian.

    file    = head, group ..., index
    head    = magic, version, offset of the index, its size, its CRC-32
    index   = frame rate, number of groups, then for each: offset, size and CRC-32 of its bytes, number of frames, frame numbers
    group   = counts and steps (GroupShape), origin and grid unit, then the coded data

A group can be decoded without the others. Everything that a reader reserves memory for is bounded by the size of the file before it
does so.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import astuple, dataclass

import numpy as np

from ...core.compression.group import GREATEST_EXTENT, GroupShape
from ...core.errors import RefMeshError

MAGIC = b"\x8fRefMesh"
VERSION = 1
HEAD = struct.Struct("<8sHxxQII")
INDEX = struct.Struct("<dI")
ENTRY = struct.Struct("<QIIH")
NUMBER = struct.Struct("<i")
GROUP = struct.Struct("<IIHHHHHIIIdddd")
MOST_FRAMES = 64  # in a group: beyond that a transform over all of them costs more than it saves
MOST_VERTICES, MOST_TRIANGLES = 1 << 22, 1 << 23
MOST_POSITIONS = 1 << 24  # vertices times frames in a group
MOST_GROUPS = 1 << 20
TRIANGLES_PER_BYTE = 4  # greatest number of triangles that a byte of a group stands for; what is coded in less is padded
POSITIONS_PER_BYTE = 64  # likewise for vertices times frames


@dataclass(frozen=True)
class Entry:
    """Where a group is.  offset, size : bytes.  checksum : CRC-32.  numbers : of its frames."""

    offset: int
    size: int
    checksum: int
    numbers: tuple[int, ...]


@dataclass(frozen=True)
class GroupHead:
    """What stands before the coded data of a group.  origin, unit : scene units; a position is origin + unit * grid position."""

    shape: GroupShape
    origin: tuple[float, float, float]
    unit: float

    def packed(self) -> bytes:
        """As it stands in the file."""
        return GROUP.pack(*astuple(self.shape), *self.origin, self.unit)

    def check(self, size: int) -> None:
        """Raises ValueError for counts that a group of so many bytes cannot have, or steps that no encoder writes."""
        shape = self.shape
        limits = {
            "vertices": (shape.vertices, 1, min(MOST_VERTICES, 3 * shape.triangles)),
            "triangles": (shape.triangles, 1, min(MOST_TRIANGLES, TRIANGLES_PER_BYTE * size)),
            "frames": (shape.frames, 1, MOST_FRAMES),
            "positions": (shape.vertices * shape.frames, 1, min(MOST_POSITIONS, POSITIONS_PER_BYTE * size)),
            "control nodes": (shape.nodes, 0, shape.vertices),
            "steps": (min(astuple(shape)[3:6] + astuple(shape)[8:]), 1, GREATEST_EXTENT),
            "greatest step": (max(astuple(shape)[3:6] + astuple(shape)[8:]), 1, GREATEST_EXTENT),
        }
        for name, (value, low, high) in limits.items():
            if not low <= value <= high:
                raise ValueError(f"{value} {name}, not {low} to {high}")
        if not (np.isfinite([*self.origin, self.unit]).all() and self.unit > 0):
            raise ValueError("a grid that is not finite")


def group_head(data: bytes) -> tuple[GroupHead, bytes]:
    """What stands before the coded data of a group, and these. Raises ValueError where it is not what an encoder writes."""
    if len(data) < GROUP.size:
        raise ValueError("a group that is cut off")
    *shape, x, y, z, unit = GROUP.unpack_from(data)
    head = GroupHead(GroupShape(*shape), (x, y, z), unit)
    head.check(len(data))
    return head, data[GROUP.size :]


def packed_index(frame_rate: float, entries: list[Entry]) -> bytes:
    """As it stands at the end of the file."""
    parts = [INDEX.pack(frame_rate, len(entries))]
    for entry in entries:
        parts.append(ENTRY.pack(entry.offset, entry.size, entry.checksum, len(entry.numbers)))
        parts += [NUMBER.pack(number) for number in entry.numbers]
    return b"".join(parts)


def packed_head(offset: int, index: bytes) -> bytes:
    """The first bytes of a file whose index lies at an offset."""
    return HEAD.pack(MAGIC, VERSION, offset, len(index), zlib.crc32(index))


def index_place(head: bytes, size: int) -> tuple[int, int, int]:
    """Offset, size and checksum of the index in a file of so many bytes. Raises RefMeshError for a file that is no .refmesh file."""
    if len(head) < HEAD.size or not head.startswith(MAGIC):
        raise RefMeshError("is not a .refmesh file")
    _, version, offset, length, checksum = HEAD.unpack(head[: HEAD.size])
    if version != VERSION:
        raise RefMeshError(f"has version {version} of the format; this RefMesh reads version {VERSION}: install the newest RefMesh")
    if not offset:
        raise RefMeshError("was not written to its end; export it again")
    if offset < HEAD.size or offset + length > size:
        raise RefMeshError("is cut off; copy or export it again")
    return offset, length, checksum


def unpacked_index(data: bytes, end: int) -> tuple[float, list[Entry]]:
    """Frame rate and groups.  end : offset of the index, before which all groups end. Raises ValueError where they cannot be right."""
    if len(data) < INDEX.size:
        raise ValueError("it is too short")
    rate, count = INDEX.unpack_from(data)
    if not (np.isfinite(rate) and rate > 0) or count > min(MOST_GROUPS, len(data) // ENTRY.size):
        raise ValueError(f"{count} groups at {rate:g} frames per second")
    place, least, entries = INDEX.size, HEAD.size, []
    for _ in range(count):
        if place + ENTRY.size > len(data):
            raise ValueError("it is too short")
        offset, size, checksum, frames = ENTRY.unpack_from(data, place)
        place += ENTRY.size
        stop = place + NUMBER.size * frames
        if offset < least or offset + size > end or not 1 <= frames <= MOST_FRAMES or stop > len(data):
            raise ValueError("a group lies where none can be")
        numbers = tuple(number for (number,) in NUMBER.iter_unpack(data[place:stop]))
        entries.append(Entry(offset, size, checksum, numbers))
        place, least = stop, offset + size
    if place != len(data):
        raise ValueError("it is too long")
    return rate, entries
