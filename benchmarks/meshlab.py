"""Surface reconstruction, remeshing and a count of crossing triangles by PyMeshLab, which ours are measured against.

PyMeshLab breaks bpy when it is imported first: only for processes without bpy.
"""

from __future__ import annotations

import numpy as np

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.mesh import triangle_areas
from refmesh_addon.core.types import TriangleMesh

SAMPLES_PER_NODE = 1.5  # few enough to follow detail; captures are dense and their noise is averaged over the frames
POINT_WEIGHT = 4.0  # the library's own balance of the screening (point) term against the smooth (gradient) term
FINER = 1.3  # triangles of the even remeshing per triangle asked for; decimation takes the surplus from flat places
FEATURE_ANGLE = 40.0  # degrees; sharper creases keep their place in remeshing
WORKING_SIZE = 1000.0  # bounding-box diagonal while remeshing: quadric collapses add an absolute term that spoils small meshes
REMESHING_ROUNDS = 4  # splits, collapses, flips and smoothing in turn; quality has settled by then


def screened_poisson(points: np.ndarray, normals: np.ndarray, depth: int) -> TriangleMesh:
    """Screened Poisson reconstruction (Kazhdan & Hoppe 2013) of (P, 3) points with (P, 3) outward unit normals.

    depth : of the octree; cells are about the longest side / 2^depth. Closed unless it leaves the octree.
    One thread, because the sums of several end in other last digits on each run.
    """
    meshes = _mesh_set(vertex_matrix=points, v_normals_matrix=normals)
    meshes.generate_surface_reconstruction_screened_poisson(
        depth=depth, threads=1, samplespernode=SAMPLES_PER_NODE, pointweight=POINT_WEIGHT
    )
    return _result(meshes)


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
    found = _result(meshes)
    return found.moved(found.vertices / scale + middle)


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
    found = meshes.current_mesh()
    if not found.face_number():
        raise RefMeshError("the surface reconstruction came out empty: use more centers or a smaller --group-size")
    return TriangleMesh(found.vertex_matrix(), found.face_matrix())
