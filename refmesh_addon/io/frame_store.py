"""Recently shown frames in memory, within a budget."""

from __future__ import annotations

import logging
from collections import OrderedDict
from pathlib import Path

from ..core.errors import RefMeshError
from .preview import PreviewMesh, preview_path, read_preview, write_preview

logger = logging.getLogger(__name__)


class FrameStore:
    """Least-recently-used cache of meshes by file; meshes that were evicted are read from the binary cache on disk.

    budget : bytes of meshes in memory; the last one is always kept.
    """

    def __init__(self, budget: int):
        self._budget = budget
        self._meshes: OrderedDict[Path, PreviewMesh] = OrderedDict()

    def read(self, path: Path, output: Path) -> PreviewMesh:
        """The mesh of a file as it is now; `output` is the folder that holds the binary cache.

        Raises RefMeshError, naming the file, when it cannot be read.
        """
        try:
            entry = preview_path(output, path)
        except OSError as error:
            raise RefMeshError(f"{path}: cannot be read ({error.strerror or error})") from error
        if entry not in self._meshes:
            self._meshes[entry] = read_preview(entry) or _converted(path, entry)
        self._meshes.move_to_end(entry)
        self._shrink()
        return self._meshes[entry]

    def set_budget(self, budget: int) -> None:
        """Changes the budget, and evicts at once what exceeds it."""
        self._budget = budget
        self._shrink()

    def clear(self) -> None:
        """Forgets all meshes."""
        self._meshes.clear()

    def _shrink(self) -> None:
        total = sum(mesh.nbytes for mesh in self._meshes.values())
        while total > self._budget and len(self._meshes) > 1:
            total -= self._meshes.popitem(last=False)[1].nbytes


def _converted(path: Path, entry: Path) -> PreviewMesh:
    from .meshes import read_mesh

    mesh = PreviewMesh.of(read_mesh(path))
    if entry.parent.parent.is_dir():  # created by a job; merely viewing a sequence leaves no folder behind
        try:
            write_preview(entry, mesh)
        except RefMeshError as error:  # a disk that is full or read-only makes frames slower, not impossible
            logger.info("%s", error)
    return mesh
