"""Writes .refmesh files, group after group, so that memory stays that of one group."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...core.color.appearance import Appearance
from ...core.compression.group import GREATEST_EXTENT, STEP
from ...core.compression.group_encoder import MARGIN, Balance, encoded_group
from ...core.compression.morph_targets import rms_along_normals
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


@dataclass(frozen=True)
class CodedPart:
    """What a run of frames became.  data : its bytes.  error : RMS distance from the frames along normals, scene units."""

    numbers: tuple[int, ...]
    data: bytes
    error: float


def write_stream(path: str | Path, groups: Iterable[FrameGroup], diagonal: float, frame_rate: float, quality: Quality) -> float:
    """Writes the groups, in their order, read one at a time; returns the largest error of a run of frames, scene units.

    diagonal : of the bounding box of the whole sequence, scene units.  frame_rate : frames per second.
    A group of more than MOST_FRAMES frames is written as several. Raises RefMeshError when the file cannot be written, or a group
    cannot be coded: it says which and why.
    """
    entries: list[Entry] = []
    worst = 0.0
    with atomic_file(path) as file:
        file.write(HEAD.pack(b"", 0, 0, 0, 0))
        for group in groups:
            for part in coded_parts(group, diagonal, quality):
                entries.append(Entry(file.tell(), len(part.data), zlib.crc32(part.data), part.numbers))
                file.write(part.data)
                worst = max(worst, part.error)
        index = packed_index(frame_rate, entries)
        offset = file.tell()
        file.write(index)
        file.seek(0)
        file.write(packed_head(offset, index))
    return worst


def coded_parts(group: FrameGroup, diagonal: float, quality: Quality) -> Iterator[CodedPart]:
    """A group as one run of frames, or as several where it is long, as `write_stream` writes it.

    diagonal : of the bounding box of the whole sequence, scene units. Raises RefMeshError where it is 0.
    """
    unit = quality.step * diagonal / STEP
    if not unit > 0:
        raise RefMeshError("a sequence without extent cannot be compressed")
    fewer, lost = _reduced(group, quality.triangles)
    for part in _parts(fewer):
        data, error = _coded(part, unit, quality.balance)
        yield CodedPart(part.numbers, data, float(np.hypot(lost, error)))


def _coded(group: FrameGroup, unit: float, balance: Balance) -> tuple[bytes, float]:
    """The bytes of a run of frames and its error.  unit : of the grid, scene units."""
    origin = group.positions.min(axis=(0, 1)) - MARGIN * unit
    grid = (group.positions - origin) / unit
    _check(group, grid)
    coder = Encoder()
    shape, decoded, order = encoded_group(coder, grid, group.triangles, balance)
    error = unit * rms_along_normals(decoded.points, grid[:, order], decoded.triangles)
    data = GroupHead(shape, (float(origin[0]), float(origin[1]), float(origin[2])), unit).packed() + coder.finished()
    least = max(-(-shape.triangles // TRIANGLES_PER_BYTE), -(-shape.vertices * shape.frames // POSITIONS_PER_BYTE))
    return data + bytes(-(-max(0, least - len(data)) // 4) * 4), error


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


def _reduced(group: FrameGroup, triangles: int) -> tuple[FrameGroup, float]:
    """The group with fewer triangles, and the RMS distance that this costs, scene units."""
    if not triangles:
        return group, 0.0
    reduction = reduced(group.positions, group.triangles, triangles)
    return FrameGroup(group.numbers, reduction.frames, reduction.triangles), reduction.error


def _parts(group: FrameGroup) -> list[FrameGroup]:
    """The group in runs of about the same length, none too long or too large."""
    count = len(group.numbers)
    most = max(1, min(MOST_FRAMES, MOST_POSITIONS // group.positions.shape[1]))
    cuts = np.linspace(0, count, -(-count // most) + 1).astype(int).tolist()
    return [FrameGroup(group.numbers[a:b], group.positions[a:b], group.triangles) for a, b in zip(cuts, cuts[1:])]
