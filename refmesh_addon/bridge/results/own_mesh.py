"""A mesh of the user's own in the scene: kept with its polygons, UV maps, vertex groups and names, and shown wherever results use it."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...core.errors import RefMeshError
from ...core.types import TriangleMesh
from ...io.files import output_folder, write_npz
from ...io.own_uvs import OWN_MESH_NAME, OWN_UVS_NAME
from ...io.ply import write_ply
from ..scene.far_origin import offset_of
from ..scene.geometry_update import OWN_MESH
from ..scene.meshes import read_positions
from ..scene.paths import absolute_path
from ..sequence.raw_sequence import read_frame

# Operators that read a file with its polygons, by suffix; the axes leave coordinates as they are.
IMPORTERS = {".obj": "obj_import", ".ply": "ply_import"}
AXES = {"forward_axis": "Y", "up_axis": "Z"}


def keep_own_mesh(owner: bpy.types.Object, target: bpy.types.Object, to_source: Matrix, folder: Path) -> Path:
    """Keeps what a render would see of the object now, modifiers applied, and writes its triangles for the job. Returns their file.

    to_source : from its own coordinates to those of the source object, as `retopology_target` gives it; the file has those of the frames.
    Raises RefMeshError for an object without faces, and when the file cannot be written.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    mesh = bpy.data.meshes.new_from_object(target.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph)
    if not len(mesh.polygons):
        bpy.data.meshes.remove(mesh)
        raise RefMeshError(f"'{target.name}' has no faces; select the mesh that was made over a frame")
    mesh.transform(to_source)
    if to_source.determinant() < 0:
        mesh.flip_normals()
    path = output_folder(folder) / OWN_MESH_NAME
    triangles = triangulated(mesh)
    write_ply(path, triangles.moved(triangles.vertices + offset_of(owner.refmesh.root)))
    _write_uvs(mesh, path.with_name(OWN_UVS_NAME))
    _keep(owner, mesh, path)
    return path


def _write_uvs(mesh: bpy.types.Mesh, path: Path) -> None:
    """The UV map that renders use, by the corners of the triangles, or no file where there is none."""
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    if layer is None:
        path.unlink(missing_ok=True)
        return
    uvs, loops = np.empty(2 * len(mesh.loops), np.float32), np.empty(3 * len(mesh.loop_triangles), np.int32)
    layer.uv.foreach_get("vector", uvs)
    mesh.loop_triangles.foreach_get("loops", loops)
    write_npz(path, {"uvs": uvs.reshape(-1, 2)[loops].reshape(-1, 3, 2)})


def adopt_own_mesh(owner: bpy.types.Object, member: bpy.types.Object, vertices: int) -> None:
    """Gives an object of the results the user's own mesh where the results are made of that, by their number of vertices."""
    own = owner.refmesh.own_mesh
    if own is None or len(own.vertices) != vertices or member.data.get(OWN_MESH) == own.name:
        return
    before, material = member.data, member.active_material
    member.data = own.copy()
    member.data.name, member.data[OWN_MESH] = before.name, own.name
    if not member.data.materials and material is not None:
        member.data.materials.append(material)
    if not before.users:
        bpy.data.meshes.remove(before)


def find_own_mesh(owner: bpy.types.Object, path: str) -> str:
    """Makes sure that the scene has the polygons of the mesh that results were made with.

    path : of its file, "" for none. Returns what is to be said where only its triangles are known.
    """
    state = owner.refmesh
    if not path:
        state.own_mesh = None
        return ""
    if state.own_mesh is not None and state.own_mesh.get(OWN_MESH) == path:
        return ""
    if not state.settings.mesh or absolute_path(owner, state.settings.mesh) != Path(path):  # results from elsewhere can name any file
        state.own_mesh = None
        return f"{path}: made over the take and shown as triangles; set it as Own Mesh and load the results again to keep its polygons"
    try:
        mesh = _imported(owner, Path(path))
    except RefMeshError as error:
        return str(error)
    if mesh is None:
        state.own_mesh = None
        return f"{Path(path).name}: shown as triangles; give it as one object in an OBJ or PLY file to keep its polygons and UV maps"
    _keep(owner, mesh, Path(path))
    return ""


def _keep(owner: bpy.types.Object, mesh: bpy.types.Mesh, path: Path) -> None:
    mesh[OWN_MESH] = str(path)
    mesh.name = f"{owner.refmesh.root.name} own mesh"
    owner.refmesh.own_mesh = mesh


def triangulated(mesh: bpy.types.Mesh) -> TriangleMesh:
    """The triangles of a Blender mesh, its vertices in their order, in the coordinates of its object."""
    mesh.calc_loop_triangles()
    corners = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    return TriangleMesh(read_positions(mesh).astype(np.float64), corners.reshape(-1, 3))


def _imported(owner: bpy.types.Object, path: Path) -> bpy.types.Mesh | None:
    """The polygons of a file, where Blender reads the same vertices in the same order as the job; otherwise None."""
    importer = IMPORTERS.get(path.suffix.lower())
    if importer is None:
        return None
    expected, active = read_frame(path, absolute_path(owner, owner.refmesh.output)), bpy.context.view_layer.objects.active
    selected, before = list(bpy.context.selected_objects), set(bpy.data.objects)
    getattr(bpy.ops.wm, importer)(filepath=str(path), **AXES)
    objects = [item for item in bpy.data.objects if item not in before]
    meshes = [item.data for item in objects]
    for item in objects:
        bpy.data.objects.remove(item)
    for item in selected:
        item.select_set(True)
    bpy.context.view_layer.objects.active = active
    positions, size = expected.vertices + expected.offset, float(np.linalg.norm(np.ptp(expected.vertices, axis=0)))
    fits = len(meshes) == 1 and len(meshes[0].vertices) == len(positions)
    if fits and np.allclose(read_positions(meshes[0]), positions, rtol=1e-5, atol=1e-6 * size):
        return meshes[0]
    for mesh in meshes:
        bpy.data.meshes.remove(mesh)
    return None
