"""A folder with a page that plays the deformed frames in a web browser."""

from __future__ import annotations

from pathlib import Path

from ...io.formats import Format
from ...io.web_page.writer import Take, viewer_problem, write_web_page
from .export import Export
from .frame_groups import frame_rate
from .small_gltf import SmallOptions, small_choice, small_estimate, small_file, small_note


def estimate(export: Export) -> str:
    """Of the GLB."""
    return small_estimate(export, small_choice(export, export.options, packed=True))


def write(export: Export) -> list[Path]:
    """All groups in one packed GLB, and the page beside it."""
    data, runs = small_file(export, small_choice(export, export.options, packed=True))
    export.notes.append(small_note(data, runs))
    title = export.owner.refmesh.root.name
    return write_web_page(export.subfolder(f"{export.name}_web"), export.name, Take(title, data, runs, frame_rate()))


FORMAT = Format(
    "web",
    "Web Page",
    (".html",),
    write=write,
    contents="A folder with a page that plays the sequence in a web browser, without a network",
    estimate=estimate,
    options=SmallOptions,
    unavailable=viewer_problem,
)
