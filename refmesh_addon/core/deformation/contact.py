"""Where surfaces touch: which body a triangle may belong to, and which parts no camera could see."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import triangle_normals, vertex_normals
from ..geometry.vectors import row_dot
from ..geometry.winding import Enclosed
from ..reference.mapping import INWARD
from ..types import TriangleMesh

MOST_OWNERS = 8  # centers that a triangle may belong to
OPPOSITE = -0.5  # greatest cosine between the normals of two surfaces in contact: 120 degrees
MARGIN = 0.1  # in s, how much farther than the nearest center the others may be


def possible_owners(mesh: TriangleMesh, centers: np.ndarray, spacing: float) -> np.ndarray:
    """(T, k) the centers that each triangle may belong to: the nearest to a point just inside it, and those little farther.

    Rows with fewer than k repeat the nearest.

    centers : (C, 3).  spacing : s, scene units. A capture bridges the crease between bodies that touch: just inside one of them,
    next to the crease, the other's center may be nearer.
    """
    inner = mesh.vertices[mesh.triangles].mean(axis=1) - INWARD * spacing * triangle_normals(mesh)
    tree, most = cKDTree(centers), min(MOST_OWNERS, len(centers))
    distance, near = tree.query(inner, k=np.arange(1, min(2, most) + 1), workers=-1)
    result = np.repeat(near[:, :1], most, axis=1)
    several = np.flatnonzero(distance[:, -1] <= distance[:, 0] + MARGIN * spacing)  # few, so that only these need the longer query
    distance, near = tree.query(inner[several], k=np.arange(1, most + 1), workers=-1)
    result[several] = np.where(distance <= distance[:, :1] + MARGIN * spacing, near, near[:, :1])
    return result


def behind_contact(
    mesh: TriangleMesh, owners: np.ndarray, centers: np.ndarray, compatible: np.ndarray, enclosed: Enclosed, spacing: float
) -> np.ndarray:
    """(R,) bool, the hidden vertices: those inside the source with another body in front of them.

    mesh : the reference deformed to the frame.  owners : (R,) the center of each vertex.  centers : (C, 3) in the frame.
    compatible : (C, C) bool, whether two centers may belong to one body.  enclosed : by the frame's surface.  spacing : s, scene units.

    In front means INWARD s along the outward normal, as far as the point inside from which a vertex finds its own center. A vertex
    that is merely deep in its own body has its own centers in front of it and does not count.
    """
    ahead = mesh.vertices + INWARD * spacing * vertex_normals(mesh)
    nearest = cKDTree(centers).query(ahead, workers=-1)[1]
    result = ~compatible[owners, nearest]
    candidates = np.flatnonzero(result)
    result[candidates] = enclosed(mesh.vertices[candidates]) & enclosed(ahead[candidates])
    return result


def faced(points: np.ndarray, normals: np.ndarray, depths: np.ndarray, surface: SurfaceIndex) -> np.ndarray:
    """(K,) bool, whether other surface that faces a point is nearer to it than the source, as in the contact of two parts of one body.

    points, normals : (K, 3) of points on the surface, inside the source.  depths : (K,) their distances from the source, scene units.
    surface : the reference deformed to the frame. No limb is as thin as that: its far side is captured as well.
    """
    directions = triangle_normals(surface.mesh)
    opposite = lambda point, triangle: row_dot(normals[point], directions[triangle]) < OPPOSITE
    return surface.query(points, float(depths.max(initial=0.0)), opposite).distances < depths
