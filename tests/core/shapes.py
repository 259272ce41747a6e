"""Bodies whose volume and inside are known, as triangle meshes."""

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from refmesh_addon.core.types import TriangleMesh

STILL = np.eye(3)
QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # x to y, y to -x
TILT = Rotation.from_rotvec([0.3, 0.5, -0.2]).as_matrix()  # a turn that leaves nothing in line with the axes


def of(shape: trimesh.Trimesh) -> TriangleMesh:
    return TriangleMesh(np.asarray(shape.vertices), np.asarray(shape.faces))


def ball(subdivisions: int = 3, radius: float = 1.0, center=(0.0, 0.0, 0.0)) -> TriangleMesh:
    return moved(of(trimesh.creation.icosphere(subdivisions, radius)), shift=center)


def box(sides=(2.0, 1.2, 0.8), subdivisions: int = 0, center=(0.0, 0.0, 0.0)) -> TriangleMesh:
    shape = trimesh.creation.box(sides)
    for _ in range(subdivisions):
        shape = shape.subdivide()
    return moved(of(shape), shift=center)


def torus(major: float = 1.0, minor: float = 0.4) -> TriangleMesh:
    return of(trimesh.creation.torus(major, minor, major_sections=32, minor_sections=16))


def moved(mesh: TriangleMesh, turn=STILL, shift=(0.0, 0.0, 0.0), scale: float = 1.0) -> TriangleMesh:
    return mesh.moved(scale * mesh.vertices @ turn.T + np.asarray(shift))


def joined(*meshes: TriangleMesh) -> TriangleMesh:
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    triangles = np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts)])
    return TriangleMesh(np.concatenate([mesh.vertices for mesh in meshes]), triangles)


def inside_out(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, mesh.triangles[:, ::-1])


def without(mesh: TriangleMesh, triangles: np.ndarray) -> TriangleMesh:
    """The mesh without the triangles marked in a (T,) mask."""
    return TriangleMesh(mesh.vertices, mesh.triangles[~triangles])


def flipped(mesh: TriangleMesh, triangles: np.ndarray) -> TriangleMesh:
    """The mesh with the triangles marked in a (T,) mask turned round."""
    return TriangleMesh(mesh.vertices, np.where(triangles[:, None], mesh.triangles[:, ::-1], mesh.triangles))


def above(mesh: TriangleMesh, height: float) -> np.ndarray:
    """(T,) mask of the triangles that lie above a height along z with all corners."""
    return mesh.vertices[mesh.triangles][:, :, 2].min(axis=1) > height
