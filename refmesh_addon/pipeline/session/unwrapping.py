"""Layouts by xatlas, in a process of its own: it can take hours on a difficult mesh, and nothing else ends it."""

from __future__ import annotations

import io
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ...core.color.layout import Layout
from ...core.geometry.vectors import TINY
from ...core.types import TriangleMesh
from .same_packages import same_path, site_flags

PROGRAM = Path(__file__).with_name("xatlas_process.py")
TIME_LIMIT = 120.0  # seconds; a person of 40k triangles takes ten


def layouts_available() -> bool:
    """Whether xatlas is installed; looks without loading it."""
    return find_spec("xatlas") is not None


def unwrapped(mesh: TriangleMesh, time_limit: float = TIME_LIMIT) -> Layout | None:
    """A layout of the mesh without mirrored charts; the same for the same mesh. None when xatlas is missing, fails or takes too long."""
    if not layouts_available():
        return None
    task = io.BytesIO()
    np.savez(task, vertices=centered(mesh), triangles=mesh.triangles.astype(np.uint32))
    command = [sys.executable, *site_flags(), str(PROGRAM), str(time_limit)]
    try:
        done = subprocess.run(command, input=task.getvalue(), env=same_path(), capture_output=True, timeout=time_limit)
    except subprocess.TimeoutExpired:
        return None
    if done.returncode != 0:
        return None
    result = np.load(io.BytesIO(done.stdout))
    return Layout(result["uvs"], result["triangles"].astype(np.int32))


def centered(mesh: TriangleMesh) -> np.ndarray:
    """(V, 3) float32 vertices around their mean, in diagonals, so that layouts do not depend on unit and place."""
    return ((mesh.vertices - mesh.vertices.mean(axis=0)) / max(mesh.diagonal, TINY)).astype(np.float32)
