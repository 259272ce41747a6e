"""Recently shown frames in memory, within a budget."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path

from ..core.errors import RefMeshError
from .preview import PreviewMesh, preview_path, read_preview


def _parsed(path: Path) -> PreviewMesh:
    from .meshes import read_mesh

    return PreviewMesh.of(read_mesh(path))


class FrameStore:
    """Least-recently-used cache of meshes by file; meshes that were evicted are read from the binary cache on disk, which jobs write.

    budget : bytes of meshes in memory; the last one is always kept.  parse : reads a mesh that is in no cache.
    """

    def __init__(self, budget: int, parse: Callable[[Path], PreviewMesh] = _parsed):
        self._budget, self.parse = budget, parse
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
            self._meshes[entry] = read_preview(entry) or self.parse(path)
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
