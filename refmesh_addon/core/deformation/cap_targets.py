"""Caps of the reference mesh and of a frame: what closes a hole of the capture ends in its rim there, and does not stand out beyond it.

Nothing of the source pulls a cap, so as-rigid-as-possible deformation alone would place it. A foot that tilts from frame to frame
would then stand on a sole that is a bulge in some of them. So vertices of a cap go to the smooth cap of the frame's own hole.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import submesh, triangle_normals, vertex_normals
from ..geometry.rings import grown
from ..geometry.vectors import row_dot
from ..surfacing.hole_caps import CappedMesh
from ..types import TriangleMesh
from .correspondence import Pairs
from .partners import STRAIGHT, Limits

PULL = 0.2  # of what pulls a vertex that the capture shows: the cap is a guess, but one that rigidity alone must not bend
RINGS = 2  # of vertices around the caps of the reference that may stand out beyond those of a frame


class CapTargets:
    """The caps of one frame, as targets for the caps of a reference mesh."""

    def __init__(self, caps: np.ndarray, adjacency: sparse.csr_matrix, frame: CappedMesh):
        """caps : (K,) vertices of the reference mesh over holes.  adjacency : (R, R) of its vertices.

        frame : with its holes capped; it may have none.
        """
        surface = submesh(frame.mesh, frame.holes >= 0)[0]
        on_cap = np.bincount(caps, minlength=adjacency.shape[0]) > 0
        self._near = np.flatnonzero(grown(adjacency, on_cap, RINGS) & bool(len(surface.triangles)))
        self._on_cap = on_cap[self._near]
        self._surface, self._normals = SurfaceIndex(surface) if len(self._near) else None, triangle_normals(surface)

    def pairs(self, mesh: TriangleMesh, limits: Limits, paired: np.ndarray) -> Pairs:
        """Vertices on caps of the deformed reference, with the closest points on caps of the frame that face the same way.

        Also those beside its caps that stand out beyond one of the frame's: they are walls that the frame has cut off higher up.
        paired : (R,) bool, vertices that had a pair before. They keep it: let go, what has been pulled in would spring out again.
        """
        if self._surface is None:
            none = np.zeros((0, 3))
            return Pairs(none.astype(np.int64), none, none, none, none[:, 0], none[:, 0])
        points = mesh.vertices[self._near]
        closest = self._surface.query(points, limits.distance)
        normals = self._normals[closest.triangles]
        facing = self._on_cap & (row_dot(vertex_normals(mesh)[self._near], normals) > limits.cosine)
        beyond = row_dot(points - closest.points, normals) > STRAIGHT * closest.distances
        near = np.flatnonzero((closest.triangles >= 0) & (facing | beyond | paired[self._near]))
        corners = np.repeat(self._near[near, None], 3, axis=1)
        shares = np.tile([1.0, 0.0, 0.0], (len(near), 1))
        distances = closest.distances[near]
        return Pairs(corners, shares, closest.points[near], normals[near], distances, PULL * limits.confidence(distances))
