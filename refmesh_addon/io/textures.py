"""Missing textures and material libraries of OBJ files."""

from __future__ import annotations

import re
from pathlib import Path

_LIBRARY = re.compile(rb"^[ \t]*mtllib[ \t]+(.+?)[ \t\r]*$", re.MULTILINE)
_MAP = re.compile(rb"^[ \t]*(?:map_\w+|bump|disp|decal|refl|norm)[ \t]+(.+?)[ \t\r]*$", re.MULTILINE | re.IGNORECASE)
_OPTION = re.compile(r"^-\w+(?:\s+(?:on|off|-?[0-9.]+))*\s+")


def missing_textures(data: bytes, path: Path) -> tuple[str, ...]:
    """Names of the material libraries and textures that an OBJ file refers to and that are missing.

    data : the bytes of the file.  path : of the file; one that is not an OBJ refers to none.
    """
    if path.suffix.lower() != ".obj":
        return ()
    missing = []
    for library in _names(_LIBRARY, data):
        library_path = path.parent / library
        try:
            textures = _names(_MAP, library_path.read_bytes())
        except OSError:
            missing.append(library)
            continue
        missing += [texture for texture in textures if not (library_path.parent / texture).is_file()]
    return tuple(dict.fromkeys(missing))


def _names(pattern: re.Pattern[bytes], data: bytes) -> list[str]:
    """File names as written on any system, without the options in front of them."""
    names = (match.decode("utf-8", "replace").replace("\\", "/") for match in pattern.findall(data))
    return [_OPTION.sub("", name) for name in names]
