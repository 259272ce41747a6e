"""The Blender that worker processes may start for what only Blender can do."""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path

from .same_packages import site_flags

BLENDER = "REFMESH_BLENDER"  # environment variable: path of a Blender; an empty one keeps workers from starting any
PACKAGE_FOLDER = Path(__file__).resolve().parents[2]


def running_blender() -> str:
    """Path of the Blender that this process is; "" where bpy is a package of Python, or not loaded."""
    app = getattr(sys.modules.get("bpy"), "app", None)
    return getattr(app, "binary_path", "") or ""


def blender_command() -> list[str] | None:
    """The start of a command line that runs a line of Python with bpy; None where there is no Blender.

    That is the one whose job this process does, which `worker_environment` names, or the package bpy.
    """
    program = os.environ.get(BLENDER, running_blender() or None)
    if program:
        return [program, "--background", "--factory-startup", "--python-exit-code", "1", "--python-expr"]
    if program is not None or find_spec("bpy") is None or not (PACKAGE_FOLDER / "bridge").is_dir():  # clusters get no bridge
        return None
    return [sys.executable, *site_flags(), "-c"]
