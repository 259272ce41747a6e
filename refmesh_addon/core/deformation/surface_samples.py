"""Samples of a surface: its vertices, then the centroids of its triangles, each with the area that it represents."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from scipy import sparse

from ..geometry.borders import border_edges
from ..geometry.mesh import area_vectors, have_distinct_corners, submesh, unique_points
from ..geometry.vectors import normalized
from ..types import FrozenArrays, TriangleMesh


@dataclass(frozen=True)
class SurfaceSamples(FrozenArrays):
    """Vertices, then centroids of triangles of a surface.

    points, normals : (N, 3).  triangles : (N,) a triangle that holds the point.
    corners, shares : (N, 3) vertices around the point and their barycentric weights.
    weights : (N,) the area that each represents, mean 1.
    """

    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray
    shares: np.ndarray
    weights: np.ndarray

    def every(self, stride: int) -> SurfaceSamples:
        """Every n-th of them."""
        return self if stride == 1 else SurfaceSamples(*(getattr(self, item.name)[::stride] for item in fields(self)))


class SurfaceSampler:
    """Built once from a mesh, then samples any deformation of it. Vertices that coincide in the mesh count as one.

    border : (T, 3) bool, the `border_edges` of the mesh.
    """

    def __init__(self, mesh: TriangleMesh):
        self.border = border_edges(mesh)
        first, place = unique_points(mesh.vertices)
        corners = first[place][mesh.triangles]
        proper = have_distinct_corners(corners)
        # In the order of the mesh: what a stride picks must not depend on coordinates.
        part, self._kept = submesh(TriangleMesh(mesh.vertices, corners), proper)
        holders = np.repeat(np.flatnonzero(proper), 3)
        shape = len(self._kept), len(mesh.triangles)
        self._around = sparse.csr_matrix((np.ones(len(holders)), (part.triangles.ravel(), holders)), shape=shape)
        last = self._around.indices[self._around.indptr[1:] - 1].astype(np.int64)
        self._triangles = np.concatenate([last, np.arange(len(mesh.triangles))])
        self._corners = np.concatenate([np.repeat(self._kept[:, None], 3, axis=1), mesh.triangles])
        self._shares = np.concatenate([np.tile([1.0, 0.0, 0.0], (len(self._kept), 1)), np.full((len(mesh.triangles), 3), 1 / 3)])

    def of(self, mesh: TriangleMesh) -> SurfaceSamples:
        """mesh : the one it was built from, or that one deformed."""
        vectors = area_vectors(mesh)
        areas = np.linalg.norm(vectors, axis=1)
        a, b, c = (mesh.vertices.take(corner, axis=0) for corner in mesh.triangles.T)
        weights = np.concatenate([self._around @ areas / 3.0, areas])
        return SurfaceSamples(
            np.concatenate([mesh.vertices[self._kept], (a + b + c) / 3.0]),
            normalized(np.concatenate([self._around @ vectors, vectors])),
            self._triangles,
            self._corners,
            self._shares,
            weights / weights.mean(),
        )
