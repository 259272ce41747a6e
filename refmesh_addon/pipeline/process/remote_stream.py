"""Compressed streams that are decoded in the process that reads files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .reading import SHARED

if TYPE_CHECKING:
    from ...io.refmesh_stream.writer import FrameGroup


class RemoteStream:
    """A .refmesh file.  numbers : of the frames of each group, in the order of the file.

    Raises what `ReadingProcess.call` raises.
    """

    def __init__(self, path: Path):
        self.path = path
        known = SHARED.call("stream_entries", str(path))
        ends = np.cumsum(known["counts"])[:-1]
        self.numbers = [tuple(part.tolist()) for part in np.split(known["numbers"], ends)]

    def group(self, index: int) -> FrameGroup:
        """Decodes one group."""
        from ...io.refmesh_stream.writer import FrameGroup  # late: SciPy comes with it, and may be missing

        group = SHARED.call("stream_group", str(self.path), index)
        return FrameGroup(tuple(group["numbers"].tolist()), group["positions"], group["triangles"])


def decoded_files(path: Path, folder: Path) -> list[Path]:
    """The files that `decode_stream` writes. Raises what `ReadingProcess.call` raises."""
    return [Path(written) for written in SHARED.call("decode", str(path), str(folder))["written"].tolist()]
