"""Bodies of a reference mesh that a frame does not show at all: they are shrunk to a point of the surface there."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import vertex_areas, vertex_components
from ..geometry.winding import Enclosed
from ..types import TriangleMesh

FAR = 0.01  # share of the source's diagonal beyond which a vertex lies on no surface of the frame
ABSENT = 0.5  # share of a body's surface that must lie so far outside the source
OUT_OF_VIEW = 0.95  # the same where a camera sees a part only: most of a body may be out of view, and what is seen of it must not be lost


def absent_bodies(mesh: TriangleMesh, source: SurfaceIndex, enclosed: Enclosed, share: float = ABSENT) -> np.ndarray:
    """(R,) bool, the vertices of the components that the frame does not show; never all of them.

    mesh : the reference mesh deformed to the frame.  source : the frame.  enclosed : by its surface; what lies inside is hidden, as in a
    contact, and may well be there.  share : of a body's surface that must be far from the source, ABSENT or OUT_OF_VIEW.
    """
    count, body = vertex_components(mesh)
    if count == 1:
        return np.zeros(len(mesh.vertices), dtype=bool)
    areas = vertex_areas(mesh)
    far = np.flatnonzero(source.query(mesh.vertices).distances > FAR * source.mesh.diagonal)
    far = far[~enclosed(mesh.vertices[far])]
    total = np.bincount(body, areas, count)
    absent = np.bincount(body[far], areas[far], count) > share * total
    absent[np.argmax(np.where(absent, -1.0, total))] = False
    return absent[body]


def shrunk(vertices: np.ndarray, mesh: TriangleMesh, absent: np.ndarray) -> np.ndarray:
    """(R, 3) vertices with each absent body in one point: the vertex of the rest that is nearest to its middle.

    mesh : the reference mesh, for its components.  absent : (R,) bool, whole components.
    """
    if not absent.any():
        return vertices
    result, present = vertices.copy(), vertices[~absent]
    body = vertex_components(mesh)[1]
    tree = cKDTree(present)
    for number in np.unique(body[absent]):
        result[body == number] = present[tree.query(vertices[body == number].mean(axis=0))[1]]
    return result
