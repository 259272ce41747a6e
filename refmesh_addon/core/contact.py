"""Surface that no camera could see because two bodies touch there."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .closest_point import SurfaceIndex
from .geometry import triangle_normals, vertex_normals
from .mapping import INWARD
from .types import TriangleMesh


def behind_contact(
    mesh: TriangleMesh, owners: np.ndarray, centers: np.ndarray, akin: np.ndarray, source: SurfaceIndex, spacing: float
) -> np.ndarray:
    """(R,) bool, whether a vertex lies inside the source with another body in front of it.

    mesh : the reference deformed to the frame.  owners : (R,) the center of each vertex.  centers : (C, 3) in the frame.
    akin : (C, C) bool, whether two centers may belong to one body.  source : the frame's surface.  spacing : s, scene units.

    In front is a step of INWARD s along the outward normal, as far as a vertex looks inward for its own center. What is
    merely deep in its own body has its own centers in front of it and does not count.
    """
    ahead = mesh.vertices + INWARD * spacing * vertex_normals(mesh)
    nearest = cKDTree(centers).query(ahead, workers=-1)[1]
    result = ~akin[owners, nearest]
    doubtful = np.flatnonzero(result)
    result[doubtful] = inside(source, mesh.vertices[doubtful]) & inside(source, ahead[doubtful])
    return result


def inside(surface: SurfaceIndex, points: np.ndarray) -> np.ndarray:
    """(N,) bool, whether each of (N, 3) points lies behind the surface at its closest point."""
    found = surface.query(points)
    normals = triangle_normals(surface.mesh)[found.triangles]
    return np.einsum("ij,ij->i", points - found.points, normals) < 0
