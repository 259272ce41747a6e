"""Vertices that end off the source, alone or few together, are brought back to it.

At the rim of a contact a vertex may be held by little more than a constraint at the far end of its triangle: a plane that leans
slightly then puts it an edge length off. In tight folds turning a triangle back may do the same. Cameras would have seen that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..geometry.borders import border_edges, on_border
from ..geometry.closest_point import SurfaceIndex
from ..geometry.rings import grown
from ..geometry.winding import Enclosed
from ..types import TriangleMesh
from .facing import Facing
from .fold_free_moves import moved_without_folds
from .membrane import connected_patches, spanned

# Mean edge lengths from the source from which a vertex is off: many times what the fit leaves elsewhere. From 0.3 on, the tips of thin
# folds count as well, and what they give up elsewhere made the 99th percentile of a dancer's distance larger by 2 %.
OFF = 0.5
REACH = 1.0  # mean edge lengths to the source within which the closest point is the place of a vertex, or of the membrane
LARGEST = 30  # vertices that are off together; more of them are surface that the fit did not reach, and a membrane would only hide it
ROUNDS = 3  # each moves what the folds of the one before have stopped
COVER_RINGS = 2  # rings of vertices around covered ones that may lie below the source as well


class VisibleSource:
    """The source of a frame.  surface : its triangles.  enclosed : whether points lie inside it."""

    def __init__(self, surface: SurfaceIndex, enclosed: Enclosed):
        self.surface, self._enclosed, self._border = surface, enclosed, border_edges(surface.mesh)

    def distances(self, points: np.ndarray, least: float, covered: np.ndarray) -> np.ndarray:
        """(N,) distance of (N, 3) points from the source, scene units; 0 up to `least`, over holes, and of covered points inside.

        covered : (N,) bool, points that other surface may hide.
        """
        closest, result = self.surface.query(points), np.zeros(len(points))
        off = np.flatnonzero(closest.distances > least)
        off = off[~on_border(self.surface.mesh, self._border, closest.triangles[off], closest.points[off])]
        off = off[~(covered[off] & self._enclosed(points[off]))]
        result[off] = closest.distances[off]
        return result


@dataclass(frozen=True)
class Surroundings:
    """Of the vertices of a mesh.

    adjacency : (R, R) of the vertices.  length : mean edge length, scene units.
    covered : (R,) bool, vertices that may lie inside the source, in contacts or as a layer that the capture does not show.
    """

    adjacency: sparse.csr_matrix
    length: float
    covered: np.ndarray

    @classmethod
    def of(cls, adjacency: sparse.csr_matrix, length: float, covered: np.ndarray) -> Surroundings:
        """With the vertices near covered ones, which lead there, as covered too.  covered : (R,) bool."""
        return cls(adjacency, length, grown(adjacency, covered, COVER_RINGS))


def without_outliers(mesh: TriangleMesh, facing: Facing, around: Surroundings, source: VisibleSource) -> TriangleMesh:
    """A deformed mesh of which vertices off the source are moved onto it; patches that would come no nearer stay.

    facing : of the mesh; no move folds a triangle.  around : of its vertices.
    """
    vertices, least = mesh.vertices, OFF * around.length
    distances = source.distances(vertices, least, around.covered)
    for _ in range(ROUNDS):
        chosen, patches = _small_patches(around.adjacency, distances > 0)
        if not len(chosen):
            break
        moved = moved_without_folds(facing, vertices, _brought_back(vertices, chosen, around, source))
        after = source.distances(moved[chosen], least, around.covered[chosen])
        nearer = (_farthest(after, patches) < _farthest(distances[chosen], patches))[patches]
        vertices, distances = vertices.copy(), np.zeros(len(vertices))
        vertices[chosen[nearer]], distances[chosen[nearer]] = moved[chosen[nearer]], after[nearer]
    return mesh.moved(vertices)


def _brought_back(vertices: np.ndarray, chosen: np.ndarray, around: Surroundings, source: VisibleSource) -> np.ndarray:
    """(R, 3) vertices with the chosen ones on the source where they are nearest to it.

    Those too far from it for that go to the membrane between their neighbors, and to the source where that is near.
    """
    goal = vertices.copy()
    goal[chosen] = spanned(around.adjacency, vertices, chosen)
    for places in (goal[chosen], vertices[chosen]):
        closest = source.surface.query(places)
        near = closest.distances < REACH * around.length
        goal[chosen[near]] = closest.points[near]
    return goal


def _small_patches(adjacency: sparse.csr_matrix, off: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`connected_patches` of the (R,) bool `off` with at most LARGEST vertices, and fewer than the piece of the mesh that they are on."""
    chosen, patches = connected_patches(adjacency, off)
    count = np.bincount(patches, minlength=1)
    bordered = np.bincount(patches, (adjacency[chosen] @ ~off) > 0, minlength=1) > 0
    kept = ((count <= LARGEST) & bordered)[patches]
    return chosen[kept], np.unique(patches[kept], return_inverse=True)[1]


def _farthest(distances: np.ndarray, patches: np.ndarray) -> np.ndarray:
    """(P,) greatest distance in each patch."""
    result = np.zeros(patches.max(initial=-1) + 1)
    np.maximum.at(result, patches, distances)
    return result
