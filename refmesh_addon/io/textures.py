"""Missing textures and material libraries of OBJ files."""

from __future__ import annotations

from pathlib import Path

from .mtl import map_names
from .obj import library_names, obj_lines
from .texture_files import TextureFiles


def missing_textures(data: bytes, path: Path) -> tuple[str, ...]:
    """Names of the material libraries and textures that an OBJ file refers to and that are missing, or outside of its folder.

    data : the bytes of the file.  path : of the file; one that is not an OBJ refers to none.
    """
    if path.suffix.lower() != ".obj":
        return ()
    files, missing = TextureFiles(path), []
    for library in library_names(obj_lines(data)):
        content = files.read(library)
        if content is None:
            missing.append(library)
        else:
            missing += [texture for texture in map_names(content) if not files.holds(texture)]
    return tuple(dict.fromkeys(missing))
