"""Writes the folder: the page, its script, and the GLB twice, the second time as a script for pages that are opened from a disk."""

from __future__ import annotations

import base64
import html
import json
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from ...core.errors import RefMeshError
from ..files import atomic_file, output_folder

if TYPE_CHECKING:
    from ..small_glb.choice import WrittenRun  # comes with SciPy, which may be missing

PLACE = Path(__file__).parent
VIEWER, PAGE = "viewer.js", "index.html"


@dataclass(frozen=True)
class Take:
    """What is shown.  title : of the page.  glb : the bytes of the file.  runs : of its frames, in order.  frame_rate : per second."""

    title: str
    glb: bytes
    runs: list[WrittenRun]
    frame_rate: float

    @property
    def numbers(self) -> list[int]:
        """Of all frames, in order."""
        return [number for run in self.runs for number in run.numbers]

    def statistics(self) -> dict[str, str]:
        """Figures as the page shows them."""
        count, size = len(self.numbers), len(self.glb)
        triangles = sorted({run.triangles for run in self.runs})
        return {
            "Frames": f"{self.numbers[0]} to {self.numbers[-1]} ({count})",
            "Frames a second": f"{self.frame_rate:g}",
            "Triangles": " to ".join(f"{number}" for number in dict.fromkeys((triangles[0], triangles[-1]))),
            "Morph targets": f"{sum(run.targets for run in self.runs)}",
            "Runs of frames": f"{len(self.runs)}",
            "File": f"{size / 1e3:.0f} kB",
            "Rate": f"{8e-6 * size * self.frame_rate / count:.2f} Mbit/s",
            "Largest error": f"{100 * max(run.error for run in self.runs):.2g} % of the diagonal (RMS)",
        }


def viewer_problem() -> str:
    """Why no page can be written; "" where one can."""
    return "" if (PLACE / VIEWER).is_file() else "the viewer is not built: run 'make web-viewer' once, which needs npm"


def write_web_page(folder: str | Path, name: str, take: Take) -> list[Path]:
    """Writes NAME.glb, NAME.glb.js, viewer.js and, last, index.html; returns their paths.

    Raises RefMeshError where the viewer is not built or a file cannot be written.
    """
    problem = viewer_problem()
    if problem:
        raise RefMeshError(problem)
    target, file = output_folder(folder), f"{name}.glb"
    as_script = b'window.REFMESH_GLB="' + base64.b64encode(take.glb) + b'";\n'
    contents = {file: take.glb, f"{file}.js": as_script, VIEWER: (PLACE / VIEWER).read_bytes(), PAGE: page(file, take).encode()}
    for kind, data in contents.items():
        with atomic_file(target / kind) as written:
            written.write(data)
    return [target / kind for kind in contents]


def page(file: str, take: Take) -> str:
    """The text of index.html.  file : name of the GLB beside it."""
    numbers = take.numbers
    shown = {"file": file, "first": numbers[0], "last": numbers[-1], "frameRate": take.frame_rate, "statistics": take.statistics()}
    data = json.dumps(shown, ensure_ascii=True).replace("<", "\\u003c")  # "</script>" in a name must not end the script
    return Template((PLACE / PAGE).read_text(encoding="utf-8")).substitute(title=html.escape(take.title), take=data)
