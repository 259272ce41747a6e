"""UV maps that a person has added to reference or result objects, kept in the output folder for the next run of Color."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ...io.files import output_folder
from ...io.own_uvs import OWN_LAYOUT_NAME, read_own_layout, write_own_layout
from ..scene.geometry_update import OWN_MESH
from ..scene.meshes import added_uvs, corner_vertices


def keep_own_layouts(owner: bpy.types.Object, folder: Path) -> bool:
    """Writes the UV maps for the job, and removes those of meshes that have none any more. Returns whether anything has changed.

    Of a group whose reference and result object both have one, that of the reference counts. Meshes of the user's own have theirs in
    another file. Raises RefMeshError when a file cannot be written.
    """
    changes = [_keep(members, folder / OWN_LAYOUT_NAME.format(index)) for index, members in enumerate(_members(owner)) if members]
    return any(changes)


def _members(owner: bpy.types.Object) -> list[list[bpy.types.Mesh]]:
    """Meshes with faces of each group, the reference mesh first."""
    groups = [[member.data for member in (group.reference, group.deformed) if member is not None] for group in owner.refmesh.groups]
    return [[mesh for mesh in meshes if len(mesh.polygons) and OWN_MESH not in mesh] for meshes in groups]


def _keep(meshes: list[bpy.types.Mesh], path: Path) -> bool:
    if not any(len(mesh.uv_layers) for mesh in meshes):
        there = path.is_file()
        path.unlink(missing_ok=True)
        return there
    added = next(((mesh, uvs) for mesh in meshes if (uvs := added_uvs(mesh)) is not None), None)
    if added is None:
        return False
    mesh, uvs = added
    triangles = corner_vertices(mesh).reshape(-1, 3)
    if _is_there(path, triangles, uvs):
        return False
    output_folder(path.parent)
    write_own_layout(path, triangles, uvs)
    return True


def _is_there(path: Path, triangles: np.ndarray, uvs: np.ndarray) -> bool:
    try:
        return all(map(np.array_equal, read_own_layout(path), (triangles, uvs)))
    except (OSError, ValueError):
        return False
