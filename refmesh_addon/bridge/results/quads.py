"""The reference mesh of a take remeshed to quads by Blender's QuadriFlow, as a new object."""

from __future__ import annotations

import bpy

from ...core.errors import RefMeshError
from ...core.reference.own_mesh import check_structure
from ..scene.meshes import fill_mesh
from ..scene.objects import remove_object
from .own_mesh import triangulated


def remesh_to_quads(context: bpy.types.Context, owner: bpy.types.Object, faces: int) -> bpy.types.Object:
    """A new object over the only reference mesh, which stays as it is, with about `faces` quads; 0 takes half of its triangles.

    The object has the coordinates of the reference mesh, is not rendered and shows its edges.
    Raises RefMeshError, leaving nothing behind, where QuadriFlow fails or returns a mesh that cannot be deformed.
    """
    reference = owner.refmesh.groups[0].reference
    triangles = triangulated(reference.data)
    name = f"{owner.refmesh.root.name} quads"
    quads = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    fill_mesh(quads.data, triangles)
    context.scene.collection.objects.link(quads)
    quads.matrix_world = reference.matrix_world.copy()
    quads.hide_render = quads.show_wire = True
    try:
        _run_quadriflow(context, quads, faces or max(1, len(triangles.triangles) // 2))
        check_structure(triangulated(quads.data))
    except (RuntimeError, ValueError) as error:  # RuntimeError: what Blender reports as an error
        remove_object(quads)
        reason = f"QuadriFlow cannot remesh '{reference.name}': {str(error).strip()}"
        remedy = "Try another number of faces, or retopologize it by hand and press Use Active Object as Mesh"
        raise RefMeshError(f"{reason}. {remedy}") from error
    return quads


def _run_quadriflow(context: bpy.types.Context, target: bpy.types.Object, faces: int) -> None:
    with context.temp_override(object=target, active_object=target, selected_objects=[target]):
        ended = bpy.ops.object.quadriflow_remesh(mode="FACES", target_faces=faces, seed=0, use_mesh_symmetry=False)
    if ended != {"FINISHED"}:
        raise ValueError("it was canceled, or the mesh is not manifold or has faces that point in inconsistent directions")
    if not len(target.data.polygons):
        raise ValueError("no face is left")
