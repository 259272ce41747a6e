"""The scene that scripts save among the results: one that the user has saved there since is renamed, never replaced."""

from __future__ import annotations

from hashlib import sha256
from itertools import count
from pathlib import Path

from ...io.files import output_folder, write_json
from ...io.regular_files import read_json, read_regular
from .job import CACHE_FOLDER

RECORD_NAME = "saved_scene.json"  # in the cache folder: digest of the scene as a script has saved it last
SAVING = "saving"  # in its place while it is saved: what a killed script leaves is nobody's work


def rename_changed(scene: Path) -> Path | None:
    """Renames a scene that is not as a script has saved it; returns its new path, None where nothing was in the way.

    From now on the file counts as a script's, until `record_scene` says what was saved. Raises RefMeshError for a folder that cannot
    be written to, OSError when the scene cannot be renamed.
    """
    kept = None
    if (scene.is_file() or scene.is_symlink()) and _recorded(scene) not in (SAVING, _digest(scene)):
        kept = next(path for number in count(1) if not (path := scene.with_name(f"{scene.stem}_kept_{number}{scene.suffix}")).exists())
        scene.rename(kept)
    write_json(output_folder(scene.parent / CACHE_FOLDER) / RECORD_NAME, SAVING)
    return kept


def record_scene(scene: Path) -> None:
    """Remembers the scene as it is now."""
    write_json(scene.parent / CACHE_FOLDER / RECORD_NAME, _digest(scene))


def _digest(scene: Path) -> str:
    try:
        return sha256(read_regular(scene)).hexdigest()
    except OSError:  # a folder, or a file that cannot be read: not a script's
        return ""


def _recorded(scene: Path) -> object:
    try:
        return read_json(scene.parent / CACHE_FOLDER / RECORD_NAME)
    except (OSError, ValueError):
        return None
