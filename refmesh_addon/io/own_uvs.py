"""The UV map of a mesh of the user's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.array_layout import check_layouts
from .files import read_npz

OWN_MESH_NAME = "own_mesh.ply"  # in the output folder: an object of the scene, for the job
OWN_UVS_NAME = "own_mesh_uvs.npz"  # beside it, where the object has a UV map


def own_uvs(path: Path) -> np.ndarray | None:
    """(T, 3, 2) float32 places of the corners of the mesh's triangles, v up; None where the file states none for some of them.

    OBJ files state them; those of an object of the scene are beside its file. Raises ValueError, OSError or RefMeshError for files that
    cannot be read.
    """
    beside = path.with_name(OWN_UVS_NAME)
    if path.name == OWN_MESH_NAME and beside.is_file():
        arrays = read_npz(beside)
        check_layouts(arrays, {"uvs": "(T, 3, 2) float32"})
        return arrays["uvs"]
    if path.suffix.lower() != ".obj":
        return None
    from .meshes import read_bytes  # here: registering the add-on needs the names above, and no SciPy
    from .obj_colors import obj_uvs

    return obj_uvs(read_bytes(path))
