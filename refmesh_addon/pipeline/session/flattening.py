"""Layouts by Blender's angle-based flattening, in a Blender of their own: the worker has none, and it could take any time."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from ...core.color.layout import Layout
from ...core.color.own_layout import layout_of
from ...core.types import TriangleMesh
from .blender_program import PACKAGE_FOLDER, blender_command
from .same_packages import same_path
from .unwrapping import TIME_LIMIT, centered

PROGRAM = "import sys; sys.path += [p for p in {paths} if p not in sys.path]; from {package}.bridge.scene.unwrapping import main; main()"


def flattened(mesh: TriangleMesh, charts: Layout | None, time_limit: float = TIME_LIMIT) -> Layout | None:
    """A layout of the mesh with the charts of another one, or of Smart UV Project; the same for the same mesh and version of Blender.

    None without Blender, and where it fails or takes too long.
    """
    command = blender_command()
    if command is None:
        return None
    with tempfile.TemporaryDirectory(prefix="refmesh-") as folder:
        task, result = (str(Path(folder) / name) for name in ("task.npz", "result.npz"))
        given = {} if charts is None else {"corners": charts.corners}
        np.savez(task, vertices=centered(mesh), triangles=mesh.triangles, **given)
        paths = json.dumps([str(PACKAGE_FOLDER.parent), *sys.path])
        line = PROGRAM.format(paths=paths, package=PACKAGE_FOLDER.name)
        try:
            done = subprocess.run(
                [*command, line, "--", task, result, str(time_limit)], env=same_path(), capture_output=True, timeout=time_limit
            )
        except (OSError, subprocess.TimeoutExpired):
            return None
        if done.returncode != 0 or not Path(result).is_file():
            return None
        try:
            return layout_of(np.load(result)["corners"])
        except ValueError:
            return None
