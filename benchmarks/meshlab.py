"""Remeshing and a count of crossing triangles by PyMeshLab, which ours are measured against.

PyMeshLab breaks bpy when it is imported first: only for processes without bpy.
"""

from __future__ import annotations

import numpy as np

from refmesh_addon.core.geometry.mesh import triangle_areas
from refmesh_addon.core.types import TriangleMesh

FINER = 1.3  # triangles of the even remeshing per requested triangle; decimation takes the surplus from flat places
FEATURE_ANGLE = 40.0  # degrees; sharper creases keep their place in remeshing
WORKING_SIZE = 1000.0  # bounding-box diagonal while remeshing: quadric collapses add an absolute term that spoils small meshes
REMESHING_ROUNDS = 4  # splits, collapses, flips and smoothing in turn; quality has settled by then


def remeshed(mesh: TriangleMesh, triangles: int) -> TriangleMesh:
    """The same surface with about `triangles` well-shaped triangles: evenly remeshed, then reduced by quadric collapses."""
    import pymeshlab

    middle, scale = mesh.vertices.mean(axis=0), WORKING_SIZE / mesh.diagonal
    work = mesh.moved((mesh.vertices - middle) * scale)
    edge = np.sqrt(triangle_areas(work).sum() / (FINER * triangles) * 4 / np.sqrt(3))
    meshes = _mesh_set(vertex_matrix=work.vertices, face_matrix=work.triangles)
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=REMESHING_ROUNDS, targetlen=pymeshlab.PureValue(edge), featuredeg=FEATURE_ANGLE, checksurfdist=False
    )
    meshes.meshing_decimation_quadric_edge_collapse(
        targetfacenum=triangles, preservetopology=True, preservenormal=True, optimalplacement=True, planarquadric=True, qualitythr=0.7
    )
    result = _result(meshes)
    return result.moved(result.vertices / scale + middle)


def self_intersections(mesh: TriangleMesh) -> int:
    """Number of triangles that cross another triangle of the mesh."""
    meshes = _mesh_set(vertex_matrix=mesh.vertices, face_matrix=mesh.triangles)
    meshes.compute_selection_by_self_intersections_per_face()
    return int(meshes.current_mesh().selected_face_number())


def _mesh_set(**matrices):
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(**matrices))
    return meshes


def _result(meshes) -> TriangleMesh:
    mesh = meshes.current_mesh()
    return TriangleMesh(mesh.vertex_matrix(), mesh.face_matrix())
