"""What surrounds the surface reconstruction: how many points, how deep, and which pieces of the result count."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.mesh import component_volumes, sample_surface, submesh, triangle_normals, vertex_components
from ..types import TriangleMesh

# Triangles where no number is asked for, at least: a coarse capture spends its few where its surface curves, in each frame elsewhere, and a
# mesh that has to fit all frames cannot. Its fit of a ball stays rippled with a sixth of these; two thirds of them miss a body
# captured with 4,000 triangles by 0.016 % of its diagonal in the mean, these by 0.013 %.
LEAST_TRIANGLES = 30_000
POINTS_PER_TRIANGLE = 6.0  # reconstruction points of a whole group for each triangle of the budget
LEAST_POINTS = 6000  # of a whole group, however few triangles: enough for the coarsest reconstruction
NEAR = 0.5  # distance, in s, within which a point supports a vertex of the reconstruction
LEAST_SUPPORT = 0.5  # share of a component's vertices that must be supported, or it is a bubble of the reconstruction
LEAST_BODY = 0.25  # s^3; what encloses less has no center to move it: a fold that frames place differently, not a body


def oriented_points(mesh: TriangleMesh, whole: np.ndarray, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """`count` points spread over the triangles marked in (T,) `whole`, and their normals, both (count, 3)."""
    surface = TriangleMesh(mesh.vertices, mesh.triangles[whole])
    points, owners = sample_surface(surface, count, rng)
    return points, triangle_normals(surface)[owners]


def triangle_budget(asked: int, captured: list[int]) -> int:
    """Triangles of a reference mesh: as asked, or for 0 the median of those of its frames, at least LEAST_TRIANGLES."""
    return asked or max(int(np.median(captured)), LEAST_TRIANGLES)


def points_per_frame(triangles: int, frames: int) -> int:
    """Points that each frame of a group gives to its reconstruction. triangles : the budget."""
    return int(np.ceil(max(POINTS_PER_TRIANGLE * triangles, LEAST_POINTS) / frames))


def supported(mesh: TriangleMesh, points: np.ndarray, spacing: float) -> TriangleMesh:
    """The mesh without bubbles: components that hardly any of the (P, 3) points lies near, and those too small to hold a center.

    spacing : s, scene units. The largest component stays whatever its size.
    """
    count, component = vertex_components(mesh)
    distance = cKDTree(points).query(mesh.vertices, distance_upper_bound=NEAR * spacing)[0]
    share = np.bincount(component, np.isfinite(distance), count) / np.bincount(component, minlength=count)
    volumes = np.abs(component_volumes(mesh, component))
    kept = ((share >= LEAST_SUPPORT) & (volumes >= min(LEAST_BODY * spacing**3, volumes.max(initial=0.0))))[component]
    return submesh(mesh, kept[mesh.triangles[:, 0]])[0]
