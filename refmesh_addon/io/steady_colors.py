"""The steady colors of a group in an output folder: its texture on its layout, or the median of its frames' vertex colors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.color.appearance import Appearance
from ..core.color.frame import textured
from ..core.color.layout import Layout
from ..core.errors import RefMeshError
from ..core.types import TriangleMesh
from .images import decoded, images_available
from .meshes import read_bytes
from .ply_colors import ply_appearance
from .regular_files import read_regular
from .result_arrays import read_layout
from .texture_files import TextureFiles

MOST_FRAMES = 9  # whose vertex colors are compared: all of them are in memory at once


def steady_colors(folder: Path, report: dict[str, Any], index: int, mesh: TriangleMesh) -> Appearance | None:
    """Colors of the triangles of group `index`; None where the results have none, or where Pillow is missing.

    mesh : the group's mesh in any frame. Raises RefMeshError for files that are missing or do not belong to the mesh.
    """
    group = report["groups"][index]
    if group.get("texture") and group.get("layout"):
        return _texture(folder / group["texture"], folder / group["layout"], mesh) if images_available() else None
    frames = [frame for frame in report["frames"] if frame["group"] == group["index"] and frame.get("colored")]
    chosen = frames[:: -(-len(frames) // MOST_FRAMES)] if frames else []
    return _median([folder / frame["colored"] for frame in chosen], mesh) if chosen else None


def _texture(picture: Path, stored_layout: Path, mesh: TriangleMesh) -> Appearance:
    layout = Layout(*read_layout(stored_layout, len(mesh.triangles)))
    try:
        data = read_regular(picture)
    except OSError as error:
        raise RefMeshError(f"{picture}: cannot be read ({error.strerror or error}); run the Color step again") from error
    return textured(mesh, layout, decoded(data, str(picture)))


def _median(paths: list[Path], mesh: TriangleMesh) -> Appearance | None:
    """None where a frame has no colors."""
    frames = [ply_appearance(read_bytes(path), TextureFiles(path)) for path in paths]
    known = [frame for frame in frames if frame is not None and len(frame.mesh.triangles) == len(mesh.triangles)]
    if not known:
        return None
    return replace(known[0], mesh=mesh, colors=np.median([frame.colors for frame in known], axis=0).astype(np.uint8))
