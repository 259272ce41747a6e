"""The compressed stream of RefMesh itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path

from ...core.options import option
from ...io.formats import Format
from .export import Export
from .frame_groups import diagonal, frame_groups, frame_rate

# Arguments of `Quality`.
QUALITIES = {"small": (1.6e-3, 10000), "balanced": (1.1e-3, 20000), "fine": (7e-4,), "near_lossless": (1e-4,)}


@dataclass(frozen=True)
class StreamOptions:
    """Options of the format."""

    quality: str = option(
        "balanced",
        "How good and how large the compressed file is",
        choices={
            "small": "10,000 triangles and coarse steps, for previews",
            "balanced": "20,000 triangles",
            "fine": "All triangles",
            "near_lossless": "All triangles, errors below 0.01 % of the size",
        },
    )
    triangles: int = option(0, "Greatest number of triangles; 0 takes that of the quality", low=0, high=10_000_000)


def unavailable() -> str:
    """Why this Blender writes no compressed streams."""
    return "" if find_spec("constriction") else "the Python package 'constriction' is missing"


def write(export: Export) -> list[Path]:
    """All groups in one file, frames by the numbers of their files."""
    from ...io.refmesh_stream.writer import Quality, write_stream  # late: SciPy comes with it, and may be missing

    options: StreamOptions = export.options
    quality = Quality(*QUALITIES[options.quality])
    if options.triangles:
        quality = replace(quality, triangles=options.triangles)
    target = export.target(FORMAT.extensions[0])
    write_stream(target, frame_groups(export, by_scene_frame=False), diagonal(export), frame_rate(), quality)
    return [target]


FORMAT = Format(
    "refmesh",
    "RefMesh Stream",
    (".refmesh",),
    write=write,
    contents="One compressed file, which 'Decode RefMesh Stream' turns into PLY files again",
    options=StreamOptions,
    unavailable=unavailable,
)
