"""Versions of RefMesh and of the packages that its results depend on."""

from __future__ import annotations

import platform
import tomllib
from importlib import metadata
from pathlib import Path

PACKAGES = ("numpy", "scipy", "trimesh", "pillow", "xatlas", "constriction", "pymeshlab")
_MANIFEST = Path(__file__).resolve().parents[2] / "blender_manifest.toml"


def versions() -> dict[str, str | None]:
    """Of RefMesh, Python and the packages; None for one that is not there. Imports none of them."""
    present: dict[str, str | None] = {"refmesh": _own_version(), "python": platform.python_version()}
    for package in PACKAGES:
        try:
            present[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            present[package] = None
    return present


def _own_version() -> str | None:
    try:
        return tomllib.loads(_MANIFEST.read_text(encoding="utf-8"))["version"]
    except (OSError, ValueError, KeyError):
        return None
