"""Which way triangles should face after a deformation, and which of them do not: folded ones, and curled ones.

A triangle is turned over when it faces away from where the rotations of its vertices take its normal. Where the source faces the
same way there, as the turned-up hem of a skirt may, it is curled, which is right; otherwise it is folded, which is a flaw.
"""

from __future__ import annotations

import numpy as np

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import area_vectors, triangles_at
from ..geometry.vectors import row_dot
from ..types import TriangleMesh

Triangles = np.ndarray | slice  # indices or a mask


class Facing:
    """The directions in which the triangles of a rest shape should face.

    rest : the shape before.  rotations : (R, 3, 3) of the surroundings of each vertex (column vectors).
    source : decides what is curled; without it nothing is.
    """

    def __init__(self, rest: TriangleMesh, rotations: np.ndarray, source: SurfaceIndex | None = None):
        self._mesh, self.source = rest, source
        flat = rotations.reshape(-1, 9)
        mixed = sum(flat.take(corner, axis=0) for corner in rest.triangles.T).reshape(-1, 3, 3)
        self._directions = np.einsum("tij,tj->ti", mixed, area_vectors(rest))

    def turned_over(self, vertices: np.ndarray, among: Triangles = slice(None)) -> np.ndarray:
        """(S,) bool, whether a triangle faces away from its direction.  vertices : (R, 3).  among : only these triangles."""
        normals = area_vectors(TriangleMesh(vertices, self._mesh.triangles[among]))
        return row_dot(self._directions[among], normals) < 0

    def folded(self, vertices: np.ndarray, among: Triangles = slice(None)) -> np.ndarray:
        """(S,) bool, whether it is turned over and faces away from the source as well; parameters as above."""
        over = self.turned_over(vertices, among)
        return over & ~self._like_source(vertices, among, over)

    def curled(self, vertices: np.ndarray) -> np.ndarray:
        """(S,) bool, whether it is turned over as the source is."""
        return self._like_source(vertices, slice(None), self.turned_over(vertices))

    def newly_folded_corners(self, vertices: np.ndarray, moved: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Corners of folded triangles at (R,) bool moved vertices, except for the (S,) bool known ones."""
        near = np.flatnonzero(triangles_at(self._mesh, moved) & ~known)
        return np.unique(self._mesh.triangles[near[self.folded(vertices, near)]])

    def _like_source(self, vertices: np.ndarray, among: Triangles, over: np.ndarray) -> np.ndarray:
        """Of the triangles `among`, those turned over as the source is.  over : bool, those turned over."""
        result = np.zeros_like(over)
        if self.source is not None and over.any():
            result[over] = _faces_like(TriangleMesh(vertices, self._mesh.triangles[among][over]), self.source)
        return result


def _faces_like(mesh: TriangleMesh, source: SurfaceIndex) -> np.ndarray:
    """(T,) bool, whether a triangle faces as the source does at the point closest to its centroid."""
    nearest = source.query(mesh.vertices[mesh.triangles].mean(axis=1)).triangles
    there = TriangleMesh(source.mesh.vertices, source.mesh.triangles[nearest])  # often a few of many
    return row_dot(area_vectors(mesh), area_vectors(there)) > 0
