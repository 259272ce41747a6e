"""Where a closed surface lies on no captured one: in the contact of two bodies, which no camera sees, and over holes of the capture.

Both are decided from the two surfaces alone, whatever the deformation did there: what it could have reached must not pass for unseen.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.borders import border_edges, on_border
from ..geometry.closest_point import ClosestPoints, SurfaceIndex
from ..geometry.holes import capped
from ..geometry.mesh import merged, submesh, triangle_normals
from ..geometry.vectors import row_dot
from ..geometry.winding import Winding
from ..types import TriangleMesh
from .sampled_surface import SampledSurface

OPPOSITE = -0.5  # greatest cosine between the normals of two surfaces in contact: 120 degrees
OFFSET = 1e-7  # share of the diagonal by which a point is moved off its own surface, too little to cross another one
TIE = 1e-9  # share by which a cap must be nearer than the source: both end at the rim, and rounding must not decide there
# Contacts are searched in bands of depth, because a search is as wide as the deepest point of its band.
FIRST_BAND = 1e-3  # bottom of the first band as a share of the greatest depth
BAND_RATIO = 2.0  # of the bottoms of successive bands


def unseen(deformed: SurfaceIndex, source: SurfaceIndex, samples: SampledSurface, closest: ClosestPoints) -> np.ndarray:
    """(N,) bool, whether a point of the deformed surface lies where the source has no surface: in a contact or over a hole.

    samples : N points on the deformed mesh, closed but for holes left open.  closest : their closest points on the source.
    """
    whole = merged(source.mesh)[0]
    closed = capped(whole)
    depths = np.where(Winding(closed).of(samples.points) != 0, closest.distances, 0.0)
    caps = submesh(closed, slice(len(whole.triangles), None))[0]
    return in_contact(deformed, samples, depths) | over_hole(source, caps, samples.points, closest)


def in_contact(deformed: SurfaceIndex, samples: SampledSurface, depths: np.ndarray) -> np.ndarray:
    """(N,) bool, whether a point of the deformed surface lies in the contact of two bodies, or of a body with itself.

    depths : (N,) distance of each point to the source where it lies inside; 0 outside.

    Three kinds of points inside the source count: those to which another part of the deformed surface, facing the other way, is
    nearer than the source (a limb is never that thin, because its own far side is captured); those with another part of the
    deformed surface around them; and those that are nearer to such points than to the source.
    """
    # The sign of the normal at the closest point would not do for the depths: in the crease of a contact the two sides disagree.
    inner = np.flatnonzero(depths > 0)
    ahead = samples.points[inner] + OFFSET * deformed.mesh.diagonal * samples.normals[inner]
    result = _faced(deformed, samples, depths)
    result[inner] |= Winding(capped(deformed.mesh)).of(ahead) > 0
    rest = inner[~result[inner]]
    if result.any() and len(rest):
        result[rest] = cKDTree(samples.points[result]).query(samples.points[rest])[0] < depths[rest]
    return result


def _faced(deformed: SurfaceIndex, samples: SampledSurface, depths: np.ndarray) -> np.ndarray:
    """(N,) bool, whether a part of the deformed surface that faces the point is nearer than the source, `depths` away."""
    result, triangles = np.zeros(len(depths), dtype=bool), triangle_normals(deformed.mesh)
    top, bottom = 0.0, FIRST_BAND * depths.max(initial=0.0)
    while (depths > top).any() and bottom > 0:  # ends: bands grow by BAND_RATIO until they reach the greatest depth
        band = np.flatnonzero((depths > top) & (depths <= bottom))
        normals = samples.normals[band]
        opposite = lambda query, triangle, normals=normals: row_dot(normals[query], triangles[triangle]) < OPPOSITE
        nearest = deformed.query(samples.points[band], bottom, opposite)
        result[band] = (nearest.triangles >= 0) & (nearest.distances < depths[band])
        top, bottom = bottom, BAND_RATIO * bottom
    return result


def over_hole(source: SurfaceIndex, caps: TriangleMesh, points: np.ndarray, closest: ClosestPoints) -> np.ndarray:
    """(N,) bool, whether each of (N, 3) points is nearer to the caps of the source's holes than to the source, or nearest to a rim.

    caps : the triangles that `capped` adds to the source.  closest : of the points on the source.
    """
    if not len(caps.triangles):
        return np.zeros(len(points), dtype=bool)
    over_cap = SurfaceIndex(caps).query(points, closest.distances.max(initial=0.0)).distances < (1.0 - TIE) * closest.distances
    return over_cap | on_border(source.mesh, border_edges(source.mesh), closest.triangles, closest.points)
