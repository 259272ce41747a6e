"""Reads .refmesh files, any group at a time."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np

from ...core.compression.group import decoded_group
from ...core.errors import RefMeshError
from ..regular_files import open_regular
from .decoder import Decoder
from .layout import HEAD, Entry, group_head, index_place, unpacked_index
from .writer import FrameGroup


class StreamReader:
    """A .refmesh file: its groups are known at once, and each is decoded on access.

    frame_rate : frames per second.  entries : the groups, in the order of the file.
    Raises RefMeshError, naming the file and what is wrong, for one that is missing, damaged, cut off or of another kind.
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)
        try:
            size = self.path.stat().st_size
            offset, length, checksum = index_place(self._bytes(0, HEAD.size), size)
            index = self._bytes(offset, length)
            if zlib.crc32(index) != checksum:
                raise ValueError("its checksum is wrong")
            self.frame_rate, self.entries = unpacked_index(index, offset)
        except OSError as error:
            raise RefMeshError(f"{self.path}: cannot be read ({error.strerror or error})") from error
        except ValueError as error:
            raise RefMeshError(f"{self.path}: the index is damaged ({error}); copy or export the file again") from error
        except RefMeshError as error:
            raise RefMeshError(f"{self.path}: {error}") from error

    def group(self, index: int) -> FrameGroup:
        """Decodes one group. Raises RefMeshError, naming its frames, where it is damaged."""
        entry = self.entries[index]
        try:
            data = self._bytes(entry.offset, entry.size)
            if len(data) < entry.size or zlib.crc32(data) != entry.checksum:
                raise ValueError("its checksum is wrong")
            return decoded(data, entry)
        except OSError as error:
            raise RefMeshError(f"{self.path}: cannot be read ({error.strerror or error})") from error
        except ValueError as error:
            where = f"frames {entry.numbers[0]} to {entry.numbers[-1]}"
            raise RefMeshError(f"{self.path}: {where} are damaged ({error}); copy or export the file again") from error

    def _bytes(self, offset: int, size: int) -> bytes:
        with open_regular(self.path) as file:
            file.seek(offset)
            return file.read(size)


def decoded(data: bytes, entry: Entry) -> FrameGroup:
    """The frames in the bytes of one group. Raises ValueError where these are not what an encoder writes."""
    head, coded = group_head(data)
    if head.shape.frames != len(entry.numbers):
        raise ValueError(f"{head.shape.frames} frames in place of {len(entry.numbers)}")
    with np.errstate(all="ignore"):
        mesh = decoded_group(Decoder(coded), head.shape)
        positions = mesh.points * head.unit
        positions += np.array(head.origin)
    if not np.isfinite(positions).all():
        raise ValueError("positions that are not finite")
    return FrameGroup(entry.numbers, positions, mesh.triangles)
