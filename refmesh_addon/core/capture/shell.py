"""A closed shell behind an open surface: the volume that centers can follow where a capture encloses none.

Its thickness is that of the take, so that it is the same in all frames and no border, which flickers, has a say. Only where the surface
curves more tightly than that, as on a finger, the shell is thinner.
"""

from __future__ import annotations

import numpy as np

from ..geometry.borders import boundary_edges
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import vertex_normals
from ..geometry.vectors import row_dot
from ..geometry.vertex_smoothing import VertexSmoother
from ..types import TriangleMesh

# Of a shell, as a share of the square root of the area: the spacing of 1000 centers in it is then as large, and they form one layer.
THICKNESS = 0.03
ROUNDS = 8  # of halving the thickness where the back folds; it is at least 1/256 of the full one
SHORTEST = 0.3  # of an edge of the back along the one in front, as a share of that one, below which the back counts as folded
SMOOTHING = 4  # steps in which the thickness blends into its surroundings


def shell_behind(mesh: TriangleMesh, thickness: float) -> TriangleMesh:
    """The closed shell between a surface and its copy moved against its normals; the triangles of the surface come first.

    mesh : neighbors face alike.  thickness : scene units.
    """
    back = mesh.moved(mesh.vertices - _depths(mesh, thickness)[:, None] * vertex_normals(mesh))
    start, end = boundary_edges(mesh).T
    count = len(mesh.vertices)
    walls = np.concatenate([np.column_stack([end, start, start + count]), np.column_stack([end, start + count, end + count])])
    return TriangleMesh(
        np.concatenate([mesh.vertices, back.vertices]), np.concatenate([mesh.triangles, mesh.triangles[:, ::-1] + count, walls])
    )


def _depths(mesh: TriangleMesh, thickness: float) -> np.ndarray:
    """(V,) thickness of the shell at each vertex, scene units."""
    normals, ends = vertex_normals(mesh), HalfEdges.of(mesh).edges.T
    front = mesh.vertices[ends[1]] - mesh.vertices[ends[0]]
    depths = np.full(len(mesh.vertices), thickness)
    for _ in range(ROUNDS):
        moves = depths[:, None] * normals
        # Edge by edge: a surface that is curved in both directions comes out behind its center with its triangles facing as before.
        folded = row_dot(front - moves[ends[1]] + moves[ends[0]], front) < SHORTEST * row_dot(front, front)
        if not folded.any():
            break
        depths[np.unique(ends[:, folded])] /= 2
    return _smoothed(mesh, depths)


def _smoothed(mesh: TriangleMesh, depths: np.ndarray) -> np.ndarray:
    """The depths, none larger than before, without steps from one vertex to the next."""
    smoother = VertexSmoother(mesh)
    for _ in range(SMOOTHING):
        depths = np.minimum(depths, smoother.step(depths))
    return depths
