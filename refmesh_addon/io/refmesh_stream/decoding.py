"""Turns a .refmesh file into a mesh file for each frame."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from ...core.errors import RefMeshError
from ...core.types import TriangleMesh
from ..files import output_folder
from ..ply import read_surface, write_ply
from .reader import StreamReader


def decode_stream(path: str | Path, folder: str | Path) -> list[Path]:
    """Writes frame_0006.ply and so on, by the numbers of the frames, one group in memory at a time; returns the files.

    folder : created where it does not exist. Files that are there already must be what is decoded.
    Raises RefMeshError for a file that is damaged, cannot be written, or would replace another one.
    """
    reader, target, written = StreamReader(path), output_folder(folder), []
    for index, entry in enumerate(reader.entries):
        group = reader.group(index)
        for number, positions in zip(entry.numbers, group.positions):
            written.append(target / f"frame_{number:04d}.ply")
            mesh = TriangleMesh(positions, group.triangles)
            if os.path.lexists(written[-1]):
                _check_same(written[-1], mesh)
            else:
                write_ply(written[-1], mesh)
    return written


def _check_same(path: Path, mesh: TriangleMesh) -> None:
    try:
        there = read_surface(path)
    except RefMeshError:
        there = None
    if there is None or not (np.array_equal(there.vertices, mesh.vertices) and np.array_equal(there.triangles, mesh.triangles)):
        raise RefMeshError(f"{path}: is another file, which is kept; choose an empty folder")
