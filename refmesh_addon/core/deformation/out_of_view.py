"""Surface of a deformed mesh that the frame of a camera does not show: turning a fold back may move it farther than surface in view.

Where the view ends before the mesh does, the fit crumples what is beyond onto the rim. Such surface has partners, so it is not held, but it
faces away from them or spans what the frame leaves open.
"""

from __future__ import annotations

import numpy as np

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import submesh, triangle_normals, triangles_at, vertex_normals
from ..geometry.rings import grown, vertices_around
from ..geometry.vectors import row_dot
from ..types import TriangleMesh
from .facing import Facing
from .folds import RINGS
from .outliers import COVER_RINGS, OFF, Surroundings

FACING = 0.2  # least cosine between the normals of both: what is seen edge on is still in view


def out_of_view(mesh: TriangleMesh, facing: Facing, around: Surroundings) -> np.ndarray:
    """(R,) bool, vertices that the frame does not show, and those that lead there.

    mesh : the reference mesh deformed to the frame.  facing : of it, with the source.  around : of the mesh, with the vertices
    that no partner holds as covered. All others are examined near folds only.
    """
    off, folded = around.covered.copy(), facing.folded(mesh.vertices)
    if facing.source is not None and folded.any():
        near = vertices_around(mesh, around.adjacency, folded, RINGS + COVER_RINGS)
        part, vertices = submesh(mesh, triangles_at(mesh, near))
        off[vertices[_off_source(part, facing.source, OFF * around.length)]] = True
    return grown(around.adjacency, off, COVER_RINGS)


def _off_source(mesh: TriangleMesh, source: SurfaceIndex, least: float) -> np.ndarray:
    """(V,) bool, vertices farther than `least` from the source or facing away from it, and the corners of triangles in the middle of
    which it is farther.
    """
    closest = source.query(mesh.vertices)
    alike = row_dot(vertex_normals(mesh), triangle_normals(source.mesh)[closest.triangles]) > FACING
    off = (closest.distances > least) | ~alike
    spanning = source.query(mesh.vertices[mesh.triangles].mean(axis=1)).distances > least
    off[mesh.triangles[spanning]] = True
    return off
