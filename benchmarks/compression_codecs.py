"""Codecs that are compared: each takes groups of frames and a setting, and gives bytes and decoded groups."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from refmesh_addon.io.refmesh_stream.reader import StreamReader
from refmesh_addon.io.refmesh_stream.writer import FrameGroup, Quality, write_stream
from refmesh_addon.io.small_glb.choice import SmallGlb
from refmesh_addon.io.small_glb.segment import fitted_segment
from refmesh_addon.io.small_glb.writer import encoded

FRAME_RATE = 30.0
DRACO_LEVEL, ZSTD_LEVEL = 10, 19  # the smallest files that Draco makes, and nearly those that zstd makes


@dataclass(frozen=True)
class Take:
    """A sequence to code.  diagonal : of its bounding box, scene units."""

    groups: list[FrameGroup]
    diagonal: float


@dataclass(frozen=True)
class Codec:
    """run(take, setting) -> size in bytes, decoded groups.  settings : from coarse to fine.  describe : a setting in a table.

    package : Python package that the codec needs besides those of RefMesh, if any.
    """

    run: Callable[[Take, object], tuple[int, list[FrameGroup]]]
    settings: tuple
    describe: Callable[[object], str]
    package: str = ""

    @property
    def is_available(self) -> bool:
        """Whether the package is installed."""
        return not self.package or find_spec(self.package) is not None


def draco(take: Take, bits: int) -> tuple[int, list[FrameGroup]]:
    """Every frame by itself; bits : of a coordinate."""
    import DracoPy

    size, decoded = 0, []
    for group in take.groups:
        frames, triangles = [], None
        for frame in group.positions:
            data = DracoPy.encode(frame, group.triangles.astype(np.uint32), quantization_bits=bits, compression_level=DRACO_LEVEL)
            size += len(data)
            mesh = DracoPy.decode(data)
            frames.append(np.asarray(mesh.points, dtype=np.float64))
            triangles = np.asarray(mesh.faces).reshape(-1, 3).astype(np.int64)  # Draco's order depends on the triangles alone
        decoded.append(FrameGroup(group.numbers, np.stack(frames), triangles))
    return size, decoded


def deltas(take: Take, step: float) -> tuple[int, list[FrameGroup]]:
    """Positions in steps, each frame less the one before, byte planes apart, packed by zstd.  step : share of the diagonal."""
    import zstandard

    size, decoded = 0, []
    for group in take.groups:
        unit = step * take.diagonal
        steps = np.rint((group.positions - group.positions.min(axis=(0, 1))) / unit).astype(np.int32)
        coded = np.concatenate([np.diff(steps[:1], axis=1, prepend=0), np.diff(steps, axis=0)])
        links = np.diff(group.triangles.astype(np.int32).ravel(), prepend=0)
        data = b"".join(values.astype("<i4").reshape(-1, 1).view(np.uint8).T.tobytes() for values in (coded, links))
        size += len(zstandard.ZstdCompressor(level=ZSTD_LEVEL).compress(data)) + 24  # and where the grid begins
        decoded.append(FrameGroup(group.numbers, steps * unit + group.positions.min(axis=(0, 1)), group.triangles))
    return size, decoded


def ours(take: Take, quality: Quality) -> tuple[int, list[FrameGroup]]:
    """A .refmesh file, index and all."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "take.refmesh"
        write_stream(path, take.groups, take.diagonal, FRAME_RATE, quality)
        reader = StreamReader(path)
        return path.stat().st_size, [reader.group(index) for index in range(len(reader.entries))]


def small_glb(take: Take, error: float) -> tuple[int, list[FrameGroup]]:
    """A small GLB, packed and without normals.  error : RMS, share of the diagonal."""
    choice, decoded = SmallGlb(error, packed=True, normals=False), []
    for group in take.groups:
        segment = fitted_segment(group, choice, take.diagonal)
        frames = np.concatenate([run.model.frames() for run in segment.runs])
        decoded.append(FrameGroup(group.numbers, frames, segment.triangles))
    return len(encoded(take.groups, take.diagonal, FRAME_RATE, choice)[0]), decoded


def _described(quality: Quality) -> str:
    return f"{quality.triangles or 'all'} triangles, step {100 * quality.step:.3g} %"


CODECS = {
    "glb": Codec(small_glb, (2e-3, 1e-3, 5.1e-4, 2.5e-4, 1e-4), lambda error: f"error {100 * error:.3g} %"),
    "draco": Codec(draco, (8, 9, 10, 11, 12), lambda bits: f"{bits} bits", "DracoPy"),
    "deltas + zstd": Codec(deltas, (2e-3, 1e-3, 5e-4, 2.5e-4), lambda step: f"step {100 * step:.3g} %", "zstandard"),
    "refmesh": Codec(
        ours,
        (
            Quality(2.4e-3, 6000),
            Quality(1.6e-3, 10000),
            Quality(1.2e-3, 15000),
            Quality(1.0e-3, 24000),
            Quality(1.0e-3),
            Quality(7e-4),
            Quality(4e-4),
        ),
        _described,
    ),
}
