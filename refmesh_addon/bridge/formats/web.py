"""A folder with a page that plays the deformed frames in a web browser."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...core.options import option
from ...io.formats import Format
from ...io.web_page.writer import Take, viewer_problem, write_web_page
from .export import Export
from .frame_groups import frame_rate
from .small_gltf import small_choice, small_file


@dataclass(frozen=True)
class WebOptions:
    """Options of the format."""

    error: float = option(0.05, "RMS distance from the frames, % of the diagonal", low=0.002, high=5.0)
    texture: int = option(1024, "Greatest side of a texture, pixels; 0 leaves colors out", low=0, high=8192)


def write(export: Export) -> list[Path]:
    """All groups in one packed GLB, and the page beside it."""
    options: WebOptions = export.options
    choice = small_choice(export, error=options.error / 100, packed=True, texture=options.texture)
    data, runs = small_file(export, choice)
    title = export.owner.refmesh.root.name
    return write_web_page(export.folder / f"{export.name}_web", export.name, Take(title, data, runs, frame_rate()))


FORMAT = Format(
    "web",
    "Web Page",
    (".html",),
    write=write,
    contents="A folder with a page that plays the sequence in a web browser, without a network",
    options=WebOptions,
    unavailable=viewer_problem,
)
