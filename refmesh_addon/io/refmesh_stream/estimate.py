"""How large a stream will be, from a few frames of each group that are really coded."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from .layout import MOST_FRAMES
from .writer import FrameGroup, Quality, coded_parts

SAMPLE = 6  # consecutive frames that are coded


@dataclass(frozen=True)
class Estimate:
    """Of a file.  size : bytes.  mbps : 10^6 bits per second.  error : RMS distance along normals, share of the diagonal."""

    size: int
    mbps: float
    error: float


def estimated(groups: Iterable[FrameGroup], diagonal: float, frame_rate: float, quality: Quality) -> Estimate:
    """Of the file that `write_stream` would write: what a single frame takes is counted once for each run of frames."""
    size, frames, error = 0.0, 0, 0.0
    for group in groups:
        count = len(group.numbers)
        start = max(0, (count - SAMPLE) // 2)
        still, moving = (_coded(group, slice(start, start + length), diagonal, quality) for length in (1, SAMPLE))
        length = min(SAMPLE, count)
        each = (moving[0] - still[0]) / max(1, length - 1)
        size += moving[0] if length == count else -(-count // MOST_FRAMES) * (still[0] - each) + count * each
        frames, error = frames + count, max(error, moving[1])
    return Estimate(round(size), 8e-6 * size * frame_rate / frames, error / diagonal)


def _coded(group: FrameGroup, rows: slice, diagonal: float, quality: Quality) -> tuple[int, float]:
    """Bytes and error of some frames of a group."""
    parts = list(coded_parts(FrameGroup(group.numbers[rows], group.positions[rows], group.triangles), diagonal, quality))
    return sum(len(part.data) for part in parts), max(part.error for part in parts)
