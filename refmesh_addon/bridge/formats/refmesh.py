"""The compressed stream of RefMesh itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.options import option
from ...io.formats import Format
from .export import Export
from .frame_groups import described, diagonal, frame_groups, frame_rate
from .small_gltf import layout_maker

if TYPE_CHECKING:
    from ...io.refmesh_stream.writer import Quality

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
    triangles: int = option(0, "Maximum number of triangles; 0 takes that of the quality", low=0, high=10_000_000)
    texture: int = option(0, "Maximum side of textures in a folder beside the file, pixels; 0 writes none", low=0, high=8192)


def unavailable() -> str:
    """Why this Blender writes no compressed streams."""
    return "" if find_spec("constriction") else "the Python package 'constriction' is missing"


def estimate(export: Export) -> str:
    """From a few frames of each group."""
    from ...io.refmesh_stream.estimate import estimated  # late: SciPy comes with it, and may be missing

    groups = frame_groups(export, by_scene_frame=False)
    result = estimated(groups, diagonal(export), frame_rate(), _quality(export.options))
    return f"about {described(result.size, result.mbps, result.error)}"


def write(export: Export) -> list[Path]:
    """All groups in one file, frames by the numbers of their files."""
    from ...io.refmesh_stream.textures import textures_folder, write_textures
    from ...io.refmesh_stream.writer import write_stream

    target, extent = export.target(FORMAT.extensions[0]), diagonal(export)
    error = write_stream(target, frame_groups(export, by_scene_frame=False), extent, frame_rate(), _quality(export.options))
    count, written = sum(len(frames) for frames in export.choice.groups.values()), target.stat().st_size
    export.notes.append(described(written, 8e-6 * written * frame_rate() / count, error / extent))
    size = export.options.texture
    groups = frame_groups(export, by_scene_frame=False, colors=True) if size else ()
    if size:
        export.subfolder(textures_folder(target).name)
    return [target, *write_textures(target, groups, size, layout_maker(export))]


def _quality(options: StreamOptions) -> Quality:
    from ...io.refmesh_stream.writer import Quality

    quality = Quality(*QUALITIES[options.quality])
    return replace(quality, triangles=options.triangles) if options.triangles else quality


FORMAT = Format(
    "refmesh",
    "RefMesh Stream",
    (".refmesh",),
    write=write,
    contents="One compressed file, which 'Decode RefMesh Stream' turns into PLY files again",
    estimate=estimate,
    options=StreamOptions,
    unavailable=unavailable,
)
