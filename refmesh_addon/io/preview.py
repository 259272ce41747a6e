"""Frames as Blender shows them, converted once to binary files that are read in milliseconds.

The key of an entry is the name of its mesh file and of its folder, size and times, so that no frame has to be read to know whether it is
current. One of the times is that of the last change of the file itself, which cannot be set back: a file that was put in the place of
another has a new one, whatever its size and the time of its content.
Jobs write the entries. They can be deleted at any time.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Annotated, get_type_hints

import numpy as np

from ..core.array_layout import check_layouts
from ..core.geometry.storage_offset import storage_offset
from ..core.types import TriangleMesh
from .files import remove_if_possible
from .npz_reader import loaded_arrays
from .regular_files import open_regular

PREVIEW_FOLDER = Path("cache") / "preview"  # in the output folder
SCHEMA = 3
_KEY_BYTES = 6


@dataclass(frozen=True)
class PreviewMesh:
    """A mesh with the edges that Blender would otherwise compute on every frame change.

    vertices : (V, 3) float32, about `offset`.  offset : (3,) float64, zeros near the origin.
    triangles : (T, 3) int32.  edges : (E, 2) int32, each once.
    triangle_edges : (T, 3) int32, the edge from each corner to the next.
    A mesh with collapsed triangles has no edges here, as Blender supports none from a vertex to itself.
    """

    vertices: Annotated[np.ndarray, "(V, 3) float32"]
    offset: Annotated[np.ndarray, "(3) float64"]
    triangles: Annotated[np.ndarray, "(T, 3) int32 < V"]
    edges: Annotated[np.ndarray, "(E, 2) int32 < V"]
    triangle_edges: Annotated[np.ndarray, "(N, 3) int32 < E"]

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
    times = f"{status.st_mtime_ns}:{status.st_ctime_ns}"
    key = hashlib.blake2b(
        f"{SCHEMA}:{frame.absolute().parent.name}/{frame.name}:{status.st_size}:{times}".encode(), digest_size=_KEY_BYTES
    ).hexdigest()
    return Path(folder) / PREVIEW_FOLDER / f"{frame.stem}-{key}.npz"


def read_preview(path: Path) -> PreviewMesh | None:
    """The mesh of an entry; None when there is none, or one that is damaged or holds indices that do not exist."""
    declared = _declared()
    try:
        with open_regular(path) as file:
            arrays = loaded_arrays(file, declared)
        check_layouts(arrays, declared)
    except (OSError, ValueError):
        return None
    return PreviewMesh(**arrays)


@cache
def _declared() -> dict[str, str]:
    return {name: hint.__metadata__[0] for name, hint in get_type_hints(PreviewMesh, include_extras=True).items()}


def remove_other_previews(folder: str | Path, keep: Iterable[Path]) -> None:
    """Removes all entries of the output folder but those to keep."""
    kept = set(keep)
    for path in (Path(folder) / PREVIEW_FOLDER).glob("*.npz"):
        if path not in kept:
            remove_if_possible(path)
