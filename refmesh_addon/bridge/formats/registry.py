"""The formats that Blender loads or writes. To add one, copy the file of the most similar one and add its record here."""

from __future__ import annotations

from pathlib import Path

from ...core.errors import RefMeshError
from ...io.files import output_folder
from ...io.formats import Format
from . import alembic, fbx, gltf, pc2, ply, refmesh, usd, vat, web
from .export import Export

MENU = (pc2, alembic, usd, gltf, fbx, web, vat, ply, refmesh)  # in this order
FORMATS = {module.FORMAT.name: module.FORMAT for module in MENU}


def written_formats() -> list[Format]:
    """Those with a writer, available or not."""
    return [known for known in FORMATS.values() if known.write]


def loaded_extensions() -> list[str]:
    """Of the formats with a loader, available or not."""
    return [extension for known in FORMATS.values() if known.load for extension in known.extensions]


def check_writable(known: Format, step: int) -> None:
    """Raises RefMeshError, with the reason, when this Blender cannot write the format, or the format has no frame step."""
    reason = known.unavailable()
    if reason:
        others = _either(other.name for other in written_formats() if not other.unavailable())
        raise RefMeshError(f"--export {known.name}: {reason}; choose {others}, or use another Blender")
    if step > 1 and known.every_frame:
        others = _either(other.name for other in written_formats() if not other.every_frame)
        raise RefMeshError(f"--export {known.name}: every frame of the range is written; leave out the step, or choose {others}")


def write(known: Format, export: Export) -> list[Path]:
    """Writes the deformed meshes of a sequence in a format, into a folder that is made if need be; returns the files.

    Raises RefMeshError when a file cannot be written.
    """
    output_folder(export.folder)
    return known.write(export)


def load(path: Path) -> None:
    """Imports a file that holds an animated scene into the present scene. Raises RefMeshError when that cannot be done."""
    known = next((known for known in FORMATS.values() if known.load and path.suffix.lower() in known.extensions), None)
    if known is None:
        raise RefMeshError(f"{path}: '{path.suffix}' is not a scene file that can be read; give one of {', '.join(loaded_extensions())}")
    reason = known.unavailable()
    if reason:
        raise RefMeshError(f"{path}: {reason}; use another Blender, or a mesh file for each frame")
    if not path.is_file():
        raise RefMeshError(f"{path}: no such file")
    known.load(path)


def _either(names) -> str:
    """Names as a choice: "pc2, glb or ply"."""
    *first, last = names
    return f"{', '.join(first)} or {last}" if first else last
