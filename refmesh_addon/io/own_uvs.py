"""UV maps of the user's own: of a mesh in place of the reference mesh, and of those added to reference meshes in Blender."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.array_layout import check_layouts
from .files import read_npz, write_npz

OWN_MESH_NAME = "own_mesh.ply"  # in the output folder: an object of the scene, for the job
OWN_UVS_NAME = "own_mesh_uvs.npz"  # beside it, where the object has a UV map
OWN_LAYOUT_NAME = "own_layout_{:03d}.npz"  # in the output folder: a UV map that was added to a group's mesh in Blender
LAYOUT = {"triangles": "(T, 3) int32", "uvs": "(T, 3, 2) float32"}


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


def write_own_layout(path: Path, triangles: np.ndarray, uvs: np.ndarray) -> None:
    """Writes a UV map by the corners of (T, 3) triangles, (T, 3, 2), v up. Raises RefMeshError when the file cannot be written."""
    write_npz(path, {"triangles": triangles.astype(np.int32), "uvs": uvs.astype(np.float32)})


def read_own_layout(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (T, 3) int32 and uvs (T, 3, 2) float32 as `write_own_layout` wrote them. Raises OSError, or ValueError for another file."""
    arrays = read_npz(path)
    check_layouts(arrays, LAYOUT)
    return arrays["triangles"], arrays["uvs"]
