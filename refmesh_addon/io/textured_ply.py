"""Binary PLY with texture coordinates of corners and the pictures that its comments name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..core.types import TriangleMesh
from .files import atomic_file

_FACE = np.dtype([("corners", "u1"), ("vertices", "<i4", 3), ("numbers", "u1"), ("texcoord", "<f4", 6), ("texnumber", "<i4")])


def write_textured_ply(path: Path, mesh: TriangleMesh, uvs: np.ndarray, materials: np.ndarray, pictures: Sequence[str]) -> None:
    """A mesh with (T, 3, 2) places of the corners in a picture, v up, and the (T,) picture of each triangle, -1 for none.

    pictures : names of files beside the mesh. Raises RefMeshError when the file cannot be written.
    """
    faces = np.zeros(len(mesh.triangles), _FACE)
    faces["corners"], faces["vertices"], faces["numbers"], faces["texcoord"] = 3, mesh.triangles, 6, uvs.reshape(-1, 6)
    faces["texnumber"] = materials
    head = ["ply", "format binary_little_endian 1.0", *(f"comment TextureFile {name}" for name in pictures)]
    head += [f"element vertex {len(mesh.vertices)}", *(f"property double {axis}" for axis in "xyz"), f"element face {len(faces)}"]
    head += ["property list uchar int vertex_indices", "property list uchar float texcoord", "property int texnumber", "end_header"]
    with atomic_file(path) as file:
        file.write("\n".join([*head, ""]).encode("utf-8"))
        file.write(mesh.vertices.astype("<f8").tobytes())
        file.write(faces.tobytes())
