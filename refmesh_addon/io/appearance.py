"""The colors of a frame, whatever its format."""

from __future__ import annotations

from pathlib import Path

from ..core.color.appearance import Appearance
from ..core.errors import RefMeshError
from .formats import frame_format
from .images import images_available
from .texture_files import TextureFiles

WITHOUT_PILLOW = "the Python package 'pillow' is missing, so pictures cannot be read: install the RefMesh extension for this platform"
# What readers raise on files that the geometry path took.
_UNREADABLE = (ValueError, LookupError, TypeError, AttributeError, OSError)


def parse_appearance(data: bytes, path: Path) -> tuple[Appearance | None, tuple[str, ...]]:
    """Colors of the frame file `path` with the bytes `data`, None where it has none, and a sentence for each thing that was wrong.

    Raises nothing for a file that `parse_mesh` reads: color that cannot be had never stops the geometry.
    """
    parse, files = frame_format(path).parse_appearance, TextureFiles(path)
    if parse is None:
        return None, ()
    if not images_available():
        return None, (WITHOUT_PILLOW,)
    try:
        appearance = parse(data, files)
    except RefMeshError as error:
        return None, (*files.notes, f"{path}: has no color: {error}")
    except _UNREADABLE as error:
        return None, (*files.notes, f"{path}: its colors cannot be read ({error})")
    return appearance, tuple(files.notes)
