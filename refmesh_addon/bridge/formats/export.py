"""One export: what of a sequence goes where."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ...core.types import TriangleMesh
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
    """

    owner: bpy.types.Object
    choice: Choice
    results: Path
    folder: Path
    options: Any = None
    apply_modifiers: bool = True
    unwrap: Callable[[TriangleMesh], Layout | None] = lambda mesh: None
    notes: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Name of the sequence as a file name."""
        return bpy.path.clean_name(self.owner.refmesh.root.name)

    def target(self, extension: str) -> Path:
        """The file that the whole sequence is written to."""
        return self.folder / f"{self.name}{extension}"
