"""Whose surface is whose where two bodies touch, and what no camera could see there."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.mesh import triangle_normals, vertex_normals
from ..geometry.winding import Enclosed
from ..reference.mapping import INWARD
from ..types import TriangleMesh

NEAR, HARDLY_FARTHER = 8, 0.1  # most centers that a triangle may belong to, and how much farther than the nearest, in s, they may be


def possible_owners(mesh: TriangleMesh, centers: np.ndarray, spacing: float) -> np.ndarray:
    """(T, k) the center nearest to a point just inside each triangle, and those hardly farther; repeated where there are fewer.

    centers : (C, 3).  spacing : s, scene units. A capture joins bodies that touch by a surface across the crease between them: just
    inside one of them, beside the crease, the other's center may be nearer.
    """
    inner = mesh.vertices[mesh.triangles].mean(axis=1) - INWARD * spacing * triangle_normals(mesh)
    tree, most = cKDTree(centers), min(NEAR, len(centers))
    distance, near = tree.query(inner, k=np.arange(1, min(2, most) + 1), workers=-1)
    result = np.repeat(near[:, :1], most, axis=1)
    several = np.flatnonzero(distance[:, -1] <= distance[:, 0] + HARDLY_FARTHER * spacing)  # few, and only they need to be asked for more
    distance, near = tree.query(inner[several], k=np.arange(1, most + 1), workers=-1)
    result[several] = np.where(distance <= distance[:, :1] + HARDLY_FARTHER * spacing, near, near[:, :1])
    return result


def behind_contact(
    mesh: TriangleMesh, owners: np.ndarray, centers: np.ndarray, akin: np.ndarray, enclosed: Enclosed, spacing: float
) -> np.ndarray:
    """(R,) bool, whether a vertex lies inside the source with another body in front of it.

    mesh : the reference deformed to the frame.  owners : (R,) the center of each vertex.  centers : (C, 3) in the frame.
    akin : (C, C) bool, whether two centers may belong to one body.  enclosed : by the frame's surface.  spacing : s, scene units.

    In front is a step of INWARD s along the outward normal, as far as a vertex looks inward for its own center. What is
    merely deep in its own body has its own centers in front of it and does not count.
    """
    ahead = mesh.vertices + INWARD * spacing * vertex_normals(mesh)
    nearest = cKDTree(centers).query(ahead, workers=-1)[1]
    result = ~akin[owners, nearest]
    doubtful = np.flatnonzero(result)
    result[doubtful] = enclosed(mesh.vertices[doubtful]) & enclosed(ahead[doubtful])
    return result
