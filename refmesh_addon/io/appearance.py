"""The colors of a frame, whatever its format."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from ..core.color.appearance import Appearance
from ..core.errors import RefMeshError
from .files import WRITTEN_LIST
from .formats import frame_format
from .images import EXTENSIONS, images_available
from .texture_files import TextureFiles

WITHOUT_PILLOW = "the Python package 'pillow' is missing, so pictures cannot be read: install the RefMesh extension for this platform"
# What readers raise on files that the geometry path took.
_UNREADABLE = (ValueError, LookupError, TypeError, AttributeError, OSError)


def files_beside(path: Path) -> list[tuple[str, int, int, int]]:
    """Name, size and times of every picture and material library in the folder of a frame or below: what its colors depend on.

    Output folders, which lie beside the frames unless another place is chosen, are passed over: their pictures change with every run.
    """
    entries = []
    for folder, folders, names in os.walk(path.parent):
        folders[:] = [name for name in folders if not Path(folder, name, WRITTEN_LIST).is_file()]
        for other in (Path(folder, name) for name in names):
            if other.suffix.lower() in (*EXTENSIONS, ".mtl") and other.is_file():
                state = other.stat()
                entries.append((other.relative_to(path.parent).as_posix(), state.st_size, state.st_mtime_ns, state.st_ctime_ns))
    return sorted(entries)


def files_read(data: bytes, path: Path) -> dict[str, bytes]:
    """Name, relative to the folder of the frame file `path` with the bytes `data`, and bytes of each file that its colors come from."""
    files = TextureFiles(path)
    _parsed(data, files)
    return {os.path.relpath(one, files.folder): content for one, content in zip(files.paths, files.contents, strict=True)}


def parse_appearance(data: bytes, path: Path) -> tuple[Appearance | None, tuple[str, ...], bytes]:
    """Colors of the frame file `path` with the bytes `data`, None where it has none.

    Second, a sentence for each thing that was wrong; third, a digest of the files that were read beside it.

    Raises nothing for a file that `parse_mesh` reads: color that cannot be had never stops the geometry.
    """
    if frame_format(path).parse_appearance is None:
        return None, (), b""
    if not images_available():
        return None, (WITHOUT_PILLOW,), b""
    files = TextureFiles(path)
    appearance = _parsed(data, files)
    return appearance, tuple(files.notes), hashlib.blake2b(b"".join(files.contents), digest_size=16).digest()


def read_appearance(data: bytes, path: Path) -> tuple[Appearance | None, TextureFiles]:
    """As `parse_appearance`, with the files that were looked for and read."""
    files = TextureFiles(path)
    return _parsed(data, files), files


def _parsed(data: bytes, files: TextureFiles) -> Appearance | None:
    """Colors of a frame; what is wrong with them is noted with the files."""
    parse = frame_format(files.frame).parse_appearance
    if parse is None or not images_available():
        return None
    try:
        return parse(data, files)
    except RefMeshError as error:
        files.notes.append(f"{files.frame}: has no color: {error}")
    except _UNREADABLE as error:
        files.notes.append(f"{files.frame}: its colors cannot be read ({error})")
    return None
