"""Where a closed surface lies on no captured one: in the contact of two bodies, which no camera sees, and over holes of the capture.

Both are told from the two surfaces alone, and not from what the deformation did there: what it could have reached counts.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.borders import border_edges, on_border
from ..geometry.closest_point import ClosestPoints, SurfaceIndex
from ..geometry.holes import capped
from ..geometry.mesh import merged, triangle_normals
from ..geometry.winding import Winding, enclosed_by

FACING = -0.5  # greatest cosine between the normals of two surfaces that touch: 120 degrees
JUST_AHEAD = 1e-7  # share of the diagonal: off the surface, and through nothing else
BANDS = 2.0  # contacts are looked for in bands of depth, each so many times as deep as the one before ...
SHALLOWEST = 1e-3  # ... from this share of the greatest depth on: a search is as wide as its band is deep


def unseen(deformed: SurfaceIndex, source: SurfaceIndex, samples: tuple[np.ndarray, np.ndarray], found: ClosestPoints) -> np.ndarray:
    """(N,) bool, whether a point of the deformed surface lies where the source has no surface.

    samples : (N, 3) points on (N,) triangles of the deformed mesh, closed.  found : their closest points on the source.
    In a contact is a point inside the source to which another part of the deformed surface, facing the other way, is nearer than
    the source; a limb is never that thin, as its own surface is there. So is one with another part of the deformed
    surface around it, and one inside the source that is nearer to such points than to the source.
    Over a hole is a point that is nearest to what closes the hole, or to the rim, where the source ends.
    """
    return in_contact(deformed, source, samples, found) | over_hole(source, samples[0])


def in_contact(deformed: SurfaceIndex, source: SurfaceIndex, samples: tuple[np.ndarray, np.ndarray], found: ClosestPoints) -> np.ndarray:
    """(N,) bool, as in `unseen`."""
    points, triangles = samples
    normals = triangle_normals(deformed.mesh)[triangles]
    # Not told from the normal at the closest point: in the crease of a contact, the two sides' normals disagree.
    depths = np.where(enclosed_by(source.mesh)(points), found.distances, 0.0)
    inner = np.flatnonzero(depths > 0)
    ahead = points[inner] + JUST_AHEAD * source.mesh.diagonal * normals[inner]
    result = _faced(deformed, points, normals, depths)
    result[inner] |= Winding(deformed.mesh).of(ahead) > 0
    rest = inner[~result[inner]]
    if result.any() and len(rest):
        result[rest] = cKDTree(points[result]).query(points[rest])[0] < depths[rest]
    return result


def _faced(deformed: SurfaceIndex, points: np.ndarray, normals: np.ndarray, depths: np.ndarray) -> np.ndarray:
    """(N,) bool, whether surface that faces a point is nearer than the source, `depths` away."""
    result, every = np.zeros(len(points), dtype=bool), triangle_normals(deformed.mesh)
    least, greatest = 0.0, SHALLOWEST * depths.max(initial=0.0)
    while (depths > least).any():
        band = np.flatnonzero((depths > least) & (depths <= greatest))
        own = normals[band]
        facing = lambda query, other, own=own: np.einsum("ni,ni->n", own[query], every[other]) < FACING
        near = deformed.query(points[band], greatest, facing)
        result[band] = (near.triangles >= 0) & (near.distances < depths[band])
        least, greatest = greatest, BANDS * greatest
    return result


def over_hole(source: SurfaceIndex, points: np.ndarray) -> np.ndarray:
    """(N,) bool, whether the nearest point of the source with its holes closed is on what closes them, or on their rim."""
    whole = merged(source.mesh)[0]
    closed = capped(whole)
    if closed is whole:
        return np.zeros(len(points), dtype=bool)
    found = SurfaceIndex(closed).query(points)
    result = found.triangles >= len(whole.triangles)
    own = np.flatnonzero(~result)
    result[own] = on_border(whole, border_edges(whole), found.triangles[own], found.points[own])
    return result
