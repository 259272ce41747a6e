"""Closed surfaces with known volume, and how far two surfaces are apart."""

import numpy as np
import trimesh

from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import sample_surface, triangle_normals
from refmesh_addon.core.types import TriangleMesh

_SHAPES = {
    "ball": trimesh.creation.icosphere(3),
    "torus": trimesh.creation.torus(1.0, 0.4),
    "two balls": trimesh.util.concatenate(
        [trimesh.creation.icosphere(3), trimesh.creation.icosphere(3, 0.5).apply_translation([2.0, 0, 0])]
    ),
}
BODIES = {name: TriangleMesh(np.asarray(shape.vertices), np.asarray(shape.faces)) for name, shape in _SHAPES.items()}


def oriented_points(body, count=4000):
    """(count, 3) points on the body and their outward normals."""
    points, triangles = sample_surface(body, count, np.random.default_rng(0))
    return points, triangle_normals(body)[triangles]


def distance(mesh, body):
    """Mean distance, the larger of both ways."""
    points = [sample_surface(surface, 2000, np.random.default_rng(0))[0] for surface in (mesh, body)]
    return max(SurfaceIndex(mesh).query(points[1]).distances.mean(), SurfaceIndex(body).query(points[0]).distances.mean())
