"""One export: what of a sequence goes where."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ...core.errors import RefMeshError
from ...core.types import TriangleMesh
from ..scene.paths import absolute_path
from .choice import Choice

if TYPE_CHECKING:
    from ...core.color.layout import Layout


@dataclass(frozen=True)
class Export:
    """What `Format.write` takes.

    owner : the sequence object.  choice : its groups and scene frames.  results : output folder of the run, where reference
    meshes, point caches, deformed frames and report.json are.  folder : to write to; exists when `write` is called.
    options : instance of `Format.options`; None for a format without options.
    apply_modifiers : whether modifiers that a person has put on the deformed meshes, above the cache, go out as well.
    unwrap : a texture layout of a mesh, for formats that reduce it; None where none can be computed.
    notes : what a format tells of the files that it has written.
    make_way : called with each file or folder before it is written, to keep what lies there and is not of an earlier export.
    """

    owner: bpy.types.Object
    choice: Choice
    results: Path
    folder: Path
    options: Any = None
    apply_modifiers: bool = True
    unwrap: Callable[[TriangleMesh], Layout | None] = lambda mesh: None
    notes: list[str] = field(default_factory=list)
    make_way: Callable[[Path], None] = lambda path: None

    @property
    def name(self) -> str:
        """Name of the sequence as a file name."""
        return bpy.path.clean_name(self.owner.refmesh.root.name)

    def target(self, extension: str) -> Path:
        """The file that the whole sequence is written to. Raises RefMeshError as `file` does."""
        return self.file(f"{self.name}{extension}")

    def file(self, name: str) -> Path:
        """A file to write in the folder. Raises RefMeshError where it would replace a captured frame, by what the files are."""
        path = self.folder / name
        if path.exists() and _identity(path) in self._captured:
            raise RefMeshError(f"{path}: is a frame of the capture, which the export would replace; choose another folder")
        self.make_way(path)
        return path

    def subfolder(self, name: str) -> Path:
        """A folder in the folder that the format fills by itself."""
        path = self.folder / name
        self.make_way(path)
        return path

    @cached_property
    def _captured(self) -> set[tuple[int, int]]:
        paths = (absolute_path(self.owner, frame.path) for frame in self.owner.refmesh.frames)
        return {_identity(path) for path in paths if path.exists()}


def _identity(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_dev, status.st_ino
