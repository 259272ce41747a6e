"""Random points on a surface together with their normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.mesh import sample_surface, triangle_normals
from ..types import FrozenArrays, TriangleMesh


@dataclass(frozen=True)
class SampledSurface(FrozenArrays):
    """points : (N, 3) scene units.  triangles : (N,) the triangle of each point.  normals : (N, 3) unit normals of these triangles."""

    points: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray

    @classmethod
    def of(cls, mesh: TriangleMesh, count: int, rng: np.random.Generator) -> SampledSurface:
        """`count` points, uniform by area. Raises ValueError for a mesh without area."""
        points, triangles = sample_surface(mesh, count, rng)
        return cls(points, triangles, triangle_normals(mesh)[triangles])
