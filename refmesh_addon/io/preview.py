"""Frames as Blender shows them, converted once to binary files that are read in milliseconds.

The key of an entry is the name of its mesh file and of its folder, size and time, so that no frame has to be read to know whether it is
current.
The files can be deleted at any time; they are written again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from ..core.errors import RefMeshError
from ..core.geometry.storage_offset import storage_offset
from ..core.types import TriangleMesh
from .files import write_npz
from .sealed_npz import DAMAGE

PREVIEW_FOLDER = Path("cache") / "preview"  # in the output folder
SCHEMA = 2
_KEY_BYTES = 6


@dataclass(frozen=True)
class PreviewMesh:
    """A mesh with the edges that Blender would otherwise compute on every frame change.

    vertices : (V, 3) float32, about `offset`.  offset : (3,) float64, zeros near the origin.
    triangles : (T, 3) int32.  edges : (E, 2) int32, each once.
    triangle_edges : (T, 3) int32, the edge from each corner to the next.
    A mesh with collapsed triangles has no edges here, as Blender supports none from a vertex to itself.
    """

    vertices: np.ndarray
    offset: np.ndarray
    triangles: np.ndarray
    edges: np.ndarray
    triangle_edges: np.ndarray

    @classmethod
    def of(cls, mesh: TriangleMesh) -> PreviewMesh:
        """Vertices and triangles in their order."""
        from ..core.geometry.half_edges import HalfEdges  # late: SciPy comes with it, and may be missing

        table, offset = HalfEdges.of(mesh), storage_offset(mesh.vertices.min(axis=0), mesh.vertices.max(axis=0))
        vertices = (mesh.vertices - offset).astype(np.float32)
        if (table.start == table.end).any():
            return cls(vertices, offset, mesh.triangles, np.empty((0, 2), np.int32), np.empty((0, 3), np.int32))
        return cls(vertices, offset, mesh.triangles, table.edges, table.edge.reshape(-1, 3).astype(np.int32))

    def about(self, offset: np.ndarray) -> PreviewMesh:
        """The same mesh, its vertices stored about another offset, (3,) float64."""
        moved = (self.vertices + (self.offset - offset)).astype(np.float32)
        return self if np.array_equal(offset, self.offset) else replace(self, vertices=moved, offset=offset)

    @property
    def nbytes(self) -> int:
        """Memory that the arrays take."""
        return sum(getattr(self, field.name).nbytes for field in fields(self))


def preview_path(folder: str | Path, frame: Path) -> Path:
    """Where the entry of a mesh file is, or would be, in the output folder. Raises OSError when the mesh file is missing."""
    status = frame.stat()
    key = hashlib.blake2b(
        f"{SCHEMA}:{frame.absolute().parent.name}/{frame.name}:{status.st_size}:{status.st_mtime_ns}".encode(), digest_size=_KEY_BYTES
    ).hexdigest()
    return Path(folder) / PREVIEW_FOLDER / f"{frame.stem}-{key}.npz"


def read_preview(path: Path) -> PreviewMesh | None:
    """The mesh of an entry; None when there is none that can be read."""
    arrays = read_arrays(path, [field.name for field in fields(PreviewMesh)])
    return None if arrays is None else PreviewMesh(**arrays)


def read_arrays(path: Path, names: Iterable[str]) -> dict[str, np.ndarray] | None:
    """Some of the arrays of an entry; None when one of them cannot be read."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in names}
    except DAMAGE:
        return None


def write_preview(path: Path, mesh: PreviewMesh, more: Mapping[str, np.ndarray] | None = None) -> None:
    """An entry, with other arrays beside the mesh. Raises RefMeshError when it cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RefMeshError(f"{path.parent}: the folder cannot be created ({error.strerror or error})") from error
    write_npz(path, {field.name: getattr(mesh, field.name) for field in fields(mesh)} | dict(more or {}))


def remove_other_previews(folder: str | Path, keep: Iterable[Path]) -> None:
    """Removes all entries of the output folder but those to keep."""
    kept = set(keep)
    for path in (Path(folder) / PREVIEW_FOLDER).glob("*.npz"):
        if path not in kept:
            path.unlink(missing_ok=True)
