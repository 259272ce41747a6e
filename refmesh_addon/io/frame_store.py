"""Recently shown frames in memory, within a budget."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path

from ..core.errors import RefMeshError
from .preview import PreviewMesh, preview_path, read_preview
from .source_colors import SourceColors


def _parsed(path: Path) -> PreviewMesh:
    from .meshes import read_mesh

    return PreviewMesh.of(read_mesh(path))


class FrameStore:
    """Least-recently-used cache of meshes by file; meshes that were evicted are read from the binary cache on disk, which jobs write.

    budget : bytes of meshes and their colors in memory; the last one is always kept.  parse : reads a mesh that is in no cache.
    """

    def __init__(self, budget: int, parse: Callable[[Path], PreviewMesh] = _parsed):
        self._budget, self.parse = budget, parse
        self._meshes: OrderedDict[Path, PreviewMesh] = OrderedDict()
        self._colors: OrderedDict[Path, SourceColors] = OrderedDict()

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

    def read_colors(self, path: Path, read: Callable[[Path], SourceColors]) -> SourceColors:
        """The colors of a file as it is now, from memory, or by `read`, which may raise RefMeshError."""
        try:
            entry = preview_path("", path)  # names the file in its present state
        except OSError as error:
            raise RefMeshError(f"{path}: cannot be read ({error.strerror or error})") from error
        if entry not in self._colors:
            self._colors[entry] = read(path)
        self._colors.move_to_end(entry)
        self._shrink()
        return self._colors[entry]

    def set_budget(self, budget: int) -> None:
        """Changes the budget, and evicts at once what exceeds it."""
        self._budget = budget
        self._shrink()

    def clear(self) -> None:
        """Forgets all meshes."""
        self._meshes.clear()
        self._colors.clear()

    def _shrink(self) -> None:
        """Evicts the oldest, of the kind that takes more, until what is left fits."""
        sizes = [sum(entry.nbytes for entry in entries.values()) for entries in (self._meshes, self._colors)]
        while sum(sizes) > self._budget and max(len(self._meshes), len(self._colors)) > 1:
            kind = int(len(self._colors) > 1 and (sizes[1] > sizes[0] or len(self._meshes) <= 1))
            oldest = (self._colors if kind else self._meshes).popitem(last=False)[1]
            sizes[kind] -= oldest.nbytes
