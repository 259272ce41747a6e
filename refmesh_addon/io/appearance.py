"""The colors of a frame, whatever its format."""

from __future__ import annotations

import hashlib
from pathlib import Path

from ..core.color.appearance import Appearance
from ..core.errors import RefMeshError
from .formats import frame_format
from .images import EXTENSIONS, images_available
from .texture_files import TextureFiles

WITHOUT_PILLOW = "the Python package 'pillow' is missing, so pictures cannot be read: install the RefMesh extension for this platform"
# What readers raise on files that the geometry path took.
_UNREADABLE = (ValueError, LookupError, TypeError, AttributeError, OSError)


def files_beside(path: Path) -> list[tuple[str, int, int]]:
    """Name, size and time of every picture and material library in the folder of a frame or below: what its colors depend on."""
    found = []
    for other in sorted(path.parent.rglob("*")):
        if other.suffix.lower() in (*EXTENSIONS, ".mtl") and other.is_file():
            state = other.stat()
            found.append((other.relative_to(path.parent).as_posix(), state.st_size, state.st_mtime_ns))
    return found


def parse_appearance(data: bytes, path: Path) -> tuple[Appearance | None, tuple[str, ...], bytes]:
    """Colors of the frame file `path` with the bytes `data`, None where it has none.

    Second, a sentence for each thing that was wrong; third, a digest of the files that were read beside it.

    Raises nothing for a file that `parse_mesh` reads: color that cannot be had never stops the geometry.
    """
    parse, files = frame_format(path).parse_appearance, TextureFiles(path)
    if parse is None:
        return None, (), b""
    if not images_available():
        return None, (WITHOUT_PILLOW,), b""
    appearance = None
    try:
        appearance = parse(data, files)
    except RefMeshError as error:
        files.notes.append(f"{path}: has no color: {error}")
    except _UNREADABLE as error:
        files.notes.append(f"{path}: its colors cannot be read ({error})")
    return appearance, tuple(files.notes), hashlib.blake2b(b"".join(files.contents), digest_size=16).digest()
