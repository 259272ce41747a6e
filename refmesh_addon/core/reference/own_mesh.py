"""A mesh of a person's own, made over a frame or over the reference mesh: whether it fits, and how it gets to the reference positions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from ..errors import RefMeshError
from ..geometry.closest_point import SurfaceIndex
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import sample_surface, triangle_normals, vertex_components
from ..geometry.self_intersection import crossing_triangles
from ..geometry.vectors import row_dot
from ..types import TriangleMesh
from .group import GroupCenters, ReferenceMesh
from .mapping import FrameMap

Closest = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  # (N, 3) points -> (N,) distances and (N, 3) normals of what is closest

SAMPLES = 4000  # points on the mesh whose distance from the frame is measured
SCALE_RANGE = (0.2, 2.0)  # of its size to the frame's: a mesh may leave much out, but not have much more
FARTHEST = 0.03  # median distance from the frame, as a share of the frame's diagonal, beyond which it is in another pose or place
FACING_OUT = 0.5  # least share of its surface that faces as the frame does
LOOSE_TRIANGLES = 4.0  # triangles per component, in the mean, below which it is cut into loose faces


def check_own_mesh(mesh: TriangleMesh, frame: TriangleMesh) -> None:
    """Raises ValueError, in plain words with the figures, for a mesh that was not made over this frame or cannot be deformed."""
    check_structure(mesh)
    index = SurfaceIndex(frame)

    def closest(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        nearest = index.query(points)
        return nearest.distances, triangle_normals(frame)[nearest.triangles]

    _check_place(mesh, frame.diagonal, closest, "the frame")


def check_structure(mesh: TriangleMesh) -> None:
    """Raises ValueError, in plain words with the figures, for a mesh that cannot be deformed, wherever it lies."""
    used = np.zeros(len(mesh.vertices), dtype=bool)
    used[mesh.triangles] = True
    if not used.all():
        raise ValueError(f"{np.count_nonzero(~used)} of its vertices belong to no face; delete loose geometry")
    pieces = vertex_components(mesh)[0]
    if pieces > 1 and len(mesh.triangles) / pieces < LOOSE_TRIANGLES:
        raise ValueError(f"it is cut into {pieces} loose pieces of {len(mesh.triangles)} triangles; merge its vertices by distance")
    if HalfEdges.of(mesh).face_counts.max() > 2:
        raise ValueError("an edge of it has more than two faces; remove inner faces")


def _check_place(mesh: TriangleMesh, diagonal: float, closest: Closest, name: str) -> None:
    """Raises ValueError for a mesh of another size, in another place, or inside out.

    diagonal : of what it was made over, scene units.  closest : distances and normals of that for (N, 3) points.  name : of that.
    """
    scale = mesh.diagonal / diagonal
    if not SCALE_RANGE[0] <= scale <= SCALE_RANGE[1]:
        raise ValueError(f"it is {scale:.3g} times as large as {name}; apply its scale, or use the units of the capture")
    points, triangles = sample_surface(mesh, SAMPLES, np.random.default_rng(0))
    distances, normals = closest(points)
    distance = float(np.median(distances)) / diagonal
    if distance > FARTHEST:
        lies = f"half of it is {distance:.1%} of the diagonal or more away from {name}"
        raise ValueError(f"{lies}; fit it to that first, or say what it was made over (--mesh-frame)")
    alike = row_dot(triangle_normals(mesh)[triangles], normals) > 0
    if alike.mean() < FACING_OUT:
        raise ValueError(f"{1 - alike.mean():.0%} of it faces the other way; flip its normals")


def placed_in_reference(mesh: TriangleMesh, points: np.ndarray, normals: np.ndarray) -> ReferenceMesh:
    """A mesh that was made over the reference mesh of a group, as it is.

    points, normals : (P, 3) of the group's anchor frame in the reference positions, scene units.
    Raises RefMeshError for a mesh that does not lie there: reference positions change with the frames of a group.
    """
    tree = cKDTree(points)

    def closest(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        distances, nearest = tree.query(places, workers=-1)
        return distances, normals[nearest]

    try:
        _check_place(mesh, float(np.linalg.norm(np.ptp(points, axis=0))), closest, "the reference positions of these frames")
    except ValueError as error:
        raise RefMeshError(f"the mesh of your own: {error}") from error
    return ReferenceMesh(mesh, int(crossing_triangles(mesh).sum()))


def carried_to_reference(mesh: TriangleMesh, centers: np.ndarray, targets: np.ndarray, group: GroupCenters, mapping: str) -> ReferenceMesh:
    """The mesh in the reference positions of a group, its vertices and triangles in their order.

    mesh : as it lies in one of the group's frames.  centers : (C, 3) tracked centers in that frame, scene units.
    targets : (C, 3) the frame's own reference centers.  mapping : of the group, as `FrameMap` takes it.
    """
    carried = FrameMap(mesh, centers, group.affinity, group.spacing, mapping).to(targets)
    return ReferenceMesh(carried, int(crossing_triangles(carried).sum()))
