"""Screened Poisson reconstruction by PyMeshLab, the reference implementation that the paper uses.

PyMeshLab breaks bpy when it is imported first, so it is imported late, in processes without bpy.
"""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np

from ...core.errors import RefMeshError
from ...core.types import TriangleMesh

PACKAGE = "pymeshlab"
FILTER = "generate_surface_reconstruction_screened_poisson"
SAMPLES_PER_NODE = 1.5  # few enough to follow detail; captures are dense and their noise is averaged over the frames
POINT_WEIGHT = 4.0  # the library's own balance of the screening (point) term against the smooth (gradient) term
REMEDY = f"install an extension zip built with PyMeshLab, run 'python -m pip install {PACKAGE}', or take --reconstruction builtin"


def is_installed() -> bool:
    """Whether PyMeshLab can be found, without loading it."""
    return find_spec(PACKAGE) is not None


def check_installed() -> None:
    """Raises RefMeshError, saying what to do, where PyMeshLab is missing."""
    if not is_installed():
        raise RefMeshError(f"--reconstruction {PACKAGE}: the Python package '{PACKAGE}' is not installed; {REMEDY}")


def screened_poisson(points: np.ndarray, normals: np.ndarray, depth: int) -> TriangleMesh:
    """Screened Poisson reconstruction (Kazhdan & Hoppe 2013) of (P, 3) points with (P, 3) outward unit normals.

    depth : of the octree; cells are about the longest side / 2^depth. Closed unless it leaves the octree.
    One thread, because the sums of several end in other last digits on each run.
    Raises RefMeshError when PyMeshLab cannot be used and when there is no surface.
    """
    meshes = _point_set(points, normals)
    getattr(meshes, FILTER)(depth=depth, threads=1, samplespernode=SAMPLES_PER_NODE, pointweight=POINT_WEIGHT)
    surface = meshes.current_mesh()
    if not surface.face_number():
        raise RefMeshError("the surface reconstruction came out empty: use more centers or a smaller --group-size")
    return TriangleMesh(surface.vertex_matrix(), surface.face_matrix())


def _point_set(points: np.ndarray, normals: np.ndarray):
    check_installed()
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    if not hasattr(meshes, FILTER):  # without its system libraries PyMeshLab loads, but has no filters
        raise RefMeshError(f"PyMeshLab lacks the filter '{FILTER}': a system library such as libOpenGL is missing; {REMEDY}")
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=points, v_normals_matrix=normals))
    return meshes
