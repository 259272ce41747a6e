"""Turns a .refmesh file into a mesh file for each frame."""

from __future__ import annotations

from pathlib import Path

from ...core.types import TriangleMesh
from ..files import output_folder
from ..ply import write_ply
from .reader import StreamReader


def decode_stream(path: str | Path, folder: str | Path) -> list[Path]:
    """Writes frame_0006.ply and so on, by the numbers of the frames, one group in memory at a time; returns the files.

    folder : created where it does not exist. Raises RefMeshError for a file that is damaged or cannot be written.
    """
    reader, target, written = StreamReader(path), output_folder(folder), []
    for index, entry in enumerate(reader.entries):
        group = reader.group(index)
        for number, positions in zip(entry.numbers, group.positions):
            written.append(target / f"frame_{number:04d}.ply")
            write_ply(written[-1], TriangleMesh(positions, group.triangles))
    return written
