"""Writes .refmesh files, group after group, so that memory stays that of one group."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...core.color.appearance import Appearance
from ...core.compression.group import GREATEST_EXTENT, STEP
from ...core.compression.group_encoder import MARGIN, Balance, encoded_group
from ...core.compression.reduction import reduced
from ...core.errors import RefMeshError
from ...core.types import FrozenArrays
from ..files import atomic_file
from .encoder import Encoder
from .layout import (
    HEAD,
    MOST_FRAMES,
    MOST_POSITIONS,
    MOST_TRIANGLES,
    MOST_VERTICES,
    POSITIONS_PER_BYTE,
    TRIANGLES_PER_BYTE,
    Entry,
    GroupHead,
    packed_head,
    packed_index,
)


@dataclass(frozen=True)
class FrameGroup(FrozenArrays):
    """Frames of one topology.

    numbers : of the F frames.  positions : (F, V, 3) float64, scene units.  triangles : (T, 3).
    appearance : colors of the triangles that are alike in all frames; None without colors. Its mesh is that of any frame.
    """

    numbers: tuple[int, ...]
    positions: np.ndarray
    triangles: np.ndarray
    appearance: Appearance | None = None


@dataclass(frozen=True)
class Quality:
    """How good and how large.

    step : quantization along normals, share of the bounding-box diagonal of the sequence.  triangles : greatest number in a group, to which
    it is reduced; 0 keeps all.  balance : how bits are shared out.
    """

    step: float = 8e-4
    triangles: int = 0
    balance: Balance = field(default_factory=Balance)


def write_stream(path: str | Path, groups: Iterable[FrameGroup], diagonal: float, frame_rate: float, quality: Quality) -> None:
    """Writes the groups, in their order, read one at a time.

    diagonal : of the bounding box of the whole sequence, scene units.  frame_rate : frames per second.
    A group of more than MOST_FRAMES frames is written as several. Raises RefMeshError when the file cannot be written, or a group
    cannot be coded: it says which and why.
    """
    unit = quality.step * diagonal / STEP
    if not unit > 0:
        raise RefMeshError(f"{path}: a sequence without extent cannot be compressed")
    entries: list[Entry] = []
    with atomic_file(path) as file:
        file.write(HEAD.pack(b"", 0, 0, 0, 0))
        for group in groups:
            for part in _parts(_reduced(group, quality.triangles)):
                data = encoded(part, unit, quality.balance)
                entries.append(Entry(file.tell(), len(data), zlib.crc32(data), part.numbers))
                file.write(data)
        index = packed_index(frame_rate, entries)
        offset = file.tell()
        file.write(index)
        file.seek(0)
        file.write(packed_head(offset, index))


def encoded(group: FrameGroup, unit: float, balance: Balance) -> bytes:
    """The bytes of one group.  unit : of the grid, scene units. Raises RefMeshError, naming the frames, when it cannot be coded."""
    origin = group.positions.min(axis=(0, 1)) - MARGIN * unit
    grid = (group.positions - origin) / unit
    _check(group, grid)
    coder = Encoder()
    shape, _, _ = encoded_group(coder, grid, group.triangles, balance)
    data = GroupHead(shape, (float(origin[0]), float(origin[1]), float(origin[2])), unit).packed() + coder.finished()
    least = max(-(-shape.triangles // TRIANGLES_PER_BYTE), -(-shape.vertices * shape.frames // POSITIONS_PER_BYTE))
    return data + bytes(-(-max(0, least - len(data)) // 4) * 4)


def _check(group: FrameGroup, grid: np.ndarray) -> None:
    where = f"frames {group.numbers[0]} to {group.numbers[-1]}"
    (_, vertices, _), triangles = grid.shape, group.triangles
    if not np.isfinite(grid).all():
        raise RefMeshError(f"{where}: positions that are not finite numbers cannot be compressed; run the Deform step again")
    if grid.max(initial=0.0) > GREATEST_EXTENT - MARGIN:
        raise RefMeshError(f"{where}: the requested error is too small for the size of the mesh; allow a larger one")
    if not len(triangles) or vertices > min(MOST_VERTICES, 3 * len(triangles)) or len(triangles) > MOST_TRIANGLES:
        raise RefMeshError(f"{where}: {vertices} vertices and {len(triangles)} triangles cannot be compressed; remove loose vertices")
    a, b, c = triangles.T
    if ((a == b) | (b == c) | (c == a)).any():
        raise RefMeshError(f"{where}: a triangle that has one vertex twice cannot be compressed; run the Reference step again")


def _reduced(group: FrameGroup, triangles: int) -> FrameGroup:
    if not triangles:
        return group
    reduction = reduced(group.positions, group.triangles, triangles)
    return FrameGroup(group.numbers, reduction.frames, reduction.triangles)


def _parts(group: FrameGroup) -> list[FrameGroup]:
    """The group in runs of about the same length, none too long or too large."""
    count = len(group.numbers)
    most = max(1, min(MOST_FRAMES, MOST_POSITIONS // group.positions.shape[1]))
    cuts = np.linspace(0, count, -(-count // most) + 1).astype(int).tolist()
    return [FrameGroup(group.numbers[a:b], group.positions[a:b], group.triangles) for a, b in zip(cuts, cuts[1:])]
