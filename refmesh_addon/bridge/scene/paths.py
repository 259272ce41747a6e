"""Paths in a scene: beside the saved .blend where there is one, and seen from the file that an object comes from."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import bpy


def library_of(owner: bpy.types.ID) -> bpy.types.Library | None:
    """The .blend that an object is linked from, also where it is overridden here; None for an object of this file."""
    override = owner.override_library
    return owner.library or (override.reference.library if override else None)


def is_linked(owner: bpy.types.Object) -> bool:
    """Whether the object or its mesh belongs to another .blend: Blender ignores what is written to it."""
    return owner.library is not None or owner.data.library is not None


def absolute_path(owner: bpy.types.ID, path: str) -> Path:
    """The absolute form of a path that `owner` holds, where "//" is the folder of the .blend that the owner comes from."""
    return Path(os.path.abspath(bpy.path.abspath(path, library=library_of(owner))))


def state_digest(path: Path) -> str:
    """16 hexadecimal digits of a file's path, size and time: those of another state of it differ. Raises OSError without it."""
    status = path.stat()
    return hashlib.blake2b(f"{path}:{status.st_size}:{status.st_mtime_ns}".encode(), digest_size=8).hexdigest()


def stored_path(path: str | Path, folder: str | Path = "") -> str:
    """The form in which a scene keeps an absolute path: relative to its .blend from the moment there is one.

    folder : of the .blend; empty for the present one.
    """
    folder = str(folder) or os.path.dirname(bpy.data.filepath)
    try:
        return bpy.path.relpath(str(path), start=folder) if folder else str(path)
    except ValueError:  # another drive on Windows
        return str(path)
