"""Places at which one surface lies far from another: few enough points to vanish in an average, and the first that a look finds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..geometry.closest_point import ClosestPoints, SurfaceIndex
from ..geometry.graph import connected_components
from ..geometry.half_edges import HalfEdges
from ..geometry.mesh import mean_edge_length, vertex_areas, vertex_normals
from ..types import FrozenArrays, TriangleMesh
from .sampled_surface import SampledSurface
from .visibility import unseen

FAR = 0.01  # share of the diagonal beyond which surface is off by more than any fit explains
MOST = 20  # places of one frame, the worst of them


@dataclass(frozen=True)
class FarPlaces(FrozenArrays):
    """Connected parts of a surface that lie farther than FAR from another one, the worst first.

    distances : (N,) the largest of each part, shares of the diagonal.  positions : (N, 3) where that is, scene units.
    areas : (N,) of each part, shares of the surface.
    """

    distances: Annotated[np.ndarray, "(N) float64"]
    positions: Annotated[np.ndarray, "(N, 3) float64"]
    areas: Annotated[np.ndarray, "(N) float64"]


def extra_places(deformed: SurfaceIndex, source: SurfaceIndex, closest: ClosestPoints) -> FarPlaces:
    """Where the deformed surface is far from the source, without what lies in a contact or over a hole.

    closest : points on the source, of each vertex of the deformed mesh.
    """
    mesh, diagonal = deformed.mesh, source.mesh.diagonal
    far = np.flatnonzero(closest.distances > FAR * diagonal)
    if len(far):
        own = ClosestPoints(closest.points[far], closest.triangles[far], closest.distances[far])
        at = SampledSurface(mesh.vertices[far], np.zeros(len(far), dtype=int), vertex_normals(mesh)[far])
        far = far[~unseen(deformed, source, at, own)]
    return _parts(mesh, closest.distances / diagonal, far)


def missing_places(source: SurfaceIndex, deformed: SurfaceIndex) -> FarPlaces:
    """Where the source is far from the deformed surface: what the capture shows and the result does not.

    What is smaller than half an edge of the deformed mesh, such as a corner of a coarse one, it cannot follow; that is no such place.
    """
    mesh = source.mesh
    shares = deformed.query(mesh.vertices).distances / mesh.diagonal
    return _parts(mesh, shares, np.flatnonzero(shares > max(FAR, 0.5 * mean_edge_length(deformed.mesh) / mesh.diagonal)))


def places_among(mesh: TriangleMesh, shares: np.ndarray, chosen: np.ndarray) -> FarPlaces:
    """Where vertices are far, of those marked in (V,) bool `chosen`.  shares : (V,) distances, shares of the diagonal."""
    return _parts(mesh, shares, np.flatnonzero(chosen & (shares > FAR)))


def no_places() -> FarPlaces:
    """None at all."""
    return FarPlaces(np.zeros(0), np.zeros((0, 3)), np.zeros(0))


def _parts(mesh: TriangleMesh, shares: np.ndarray, far: np.ndarray) -> FarPlaces:
    """The connected parts that the far vertices, given by index, make up. shares : (V,) distances."""
    if not len(far):
        return no_places()
    place = np.full(len(mesh.vertices), -1)
    place[far] = np.arange(len(far))
    table = HalfEdges.of(mesh)
    edges = place[np.column_stack([table.start, table.end])]
    count, part = connected_components(edges[(edges >= 0).all(axis=1)], len(far))
    order = far[np.lexsort((-shares[far], part))]  # of each part the worst vertex first
    worst = order[np.unique(part[place[order]], return_index=True)[1]]
    around = vertex_areas(mesh)
    areas = np.bincount(part, around[far], count) / around.sum()
    chosen = np.argsort(-shares[worst], kind="stable")[:MOST]
    return FarPlaces(shares[worst][chosen], mesh.vertices[worst][chosen], areas[chosen])
