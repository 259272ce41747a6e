"""Points on the surface of an aligned frame, with normals: what the frame contributes to the reconstruction of its group."""

from __future__ import annotations

import numpy as np

from ..geometry.mesh import sample_surface, triangle_normals
from ..types import TriangleMesh


def oriented_points(
    mesh: TriangleMesh, whole: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`count` points spread evenly by area over the triangles marked in (T,) bool `whole`, and their unit normals, both (count, 3).

    The third result is the (count,) triangle of each.
    """
    surface = TriangleMesh(mesh.vertices, mesh.triangles[whole])
    points, owners = sample_surface(surface, count, rng)
    return points, triangle_normals(surface)[owners], np.flatnonzero(whole)[owners]
