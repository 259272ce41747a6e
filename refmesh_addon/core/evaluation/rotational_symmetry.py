"""Bodies that are nearly rotationally symmetric: how they spin about their axis does not show in their volume."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import submesh, triangle_areas, vertex_areas, vertex_components
from ..types import TriangleMesh

SAMPLES = 500  # vertices of a body that are rotated, about
ANGLES = (0.4, 1.1, 1.9, 2.7)  # radians; no two of them near symmetries of the same prism
SYMMETRIC = 0.02  # mean distance of the rotated surface from itself, in radii of a sphere of the same area
LARGE = 0.03  # share of the surface below which a component is not judged


def symmetric_bodies(mesh: TriangleMesh) -> np.ndarray:
    """(N, 3) middles of the components that are nearly rotationally symmetric about some axis, scene units."""
    count, label = vertex_components(mesh)
    part = label[mesh.triangles[:, 0]]
    areas = np.bincount(part, triangle_areas(mesh), count)
    bodies = [submesh(mesh, part == number)[0] for number in np.flatnonzero(areas >= LARGE * areas.sum())]
    return np.array([np.average(body.vertices, axis=0, weights=vertex_areas(body)) for body in bodies if is_symmetric(body)]).reshape(-1, 3)


def is_symmetric(body: TriangleMesh) -> bool:
    """Whether a closed body, rotated about one of its principal axes, nearly stays the same."""
    areas = vertex_areas(body)
    middle, radius = np.average(body.vertices, axis=0, weights=areas), np.sqrt(areas.sum() / (4.0 * np.pi))
    offsets, index = body.vertices - middle, SurfaceIndex(body)
    axes = np.linalg.eigh((offsets * areas[:, None]).T @ offsets)[1].T
    some = offsets[:: max(1, len(offsets) // SAMPLES)]
    away = lambda axis, angle: index.query(middle + Rotation.from_rotvec(angle * axis).apply(some)).distances.mean()
    return any(all(away(axis, angle) < SYMMETRIC * radius for angle in ANGLES) for axis in axes)
