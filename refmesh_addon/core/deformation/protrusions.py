"""Vertices that stick out of the source, alone or few together, are brought back to it.

At the rim of a contact a vertex may be held by little more than a constraint at the far end of its triangle: a plane that leans
slightly then puts it an edge length off. Cameras would have seen it there, so its place is on the source.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..geometry.borders import border_edges, on_border
from ..geometry.closest_point import SurfaceIndex
from ..geometry.winding import Enclosed
from ..types import TriangleMesh
from .facing import Facing
from .fold_free_moves import moved_without_folds
from .membrane import connected_patches, spanned

HEIGHT = 0.3  # mean edge lengths above the source from which a vertex sticks out: several times what the fit leaves elsewhere
REACH = 1.0  # mean edge lengths from the membrane to the source; where it is farther, as over a contact, the membrane is the better guess
LARGEST = 30  # vertices that stick out together; more of them are surface that the fit did not reach, and a membrane would only hide it
ROUNDS = 3  # each moves what the folds of the one before have stopped


class VisibleSource:
    """The source of a frame.  surface : its triangles.  enclosed : whether points lie inside it."""

    def __init__(self, surface: SurfaceIndex, enclosed: Enclosed):
        self.surface, self._enclosed, self._border = surface, enclosed, border_edges(surface.mesh)

    def heights(self, points: np.ndarray, least: float) -> np.ndarray:
        """(N,) distance of (N, 3) points above the source, scene units; 0 inside, up to `least`, and over holes, where no camera saw."""
        closest, result = self.surface.query(points), np.zeros(len(points))
        above = np.flatnonzero(closest.distances > least)
        above = above[~self._enclosed(points[above])]
        above = above[~on_border(self.surface.mesh, self._border, closest.triangles[above], closest.points[above])]
        result[above] = closest.distances[above]
        return result


def without_protrusions(
    mesh: TriangleMesh, facing: Facing, adjacency: sparse.csr_matrix, source: VisibleSource, length: float
) -> TriangleMesh:
    """A deformed mesh of which vertices that stick out are moved onto the source; patches that would come no nearer stay.

    facing : of the mesh; no move folds a triangle.  adjacency : (R, R) of its vertices.  length : its mean edge length, scene units.
    """
    vertices = mesh.vertices
    heights = source.heights(vertices, HEIGHT * length)
    for _ in range(ROUNDS):
        chosen, patches = _small_patches(adjacency, heights > 0)
        if not len(chosen):
            break
        moved = moved_without_folds(facing, vertices, _brought_back(vertices, chosen, adjacency, source, length))
        after = source.heights(moved[chosen], HEIGHT * length)
        nearer = (_highest(after, patches) < _highest(heights[chosen], patches))[patches]
        vertices, heights = vertices.copy(), np.zeros(len(vertices))
        vertices[chosen[nearer]], heights[chosen[nearer]] = moved[chosen[nearer]], after[nearer]
    return mesh.moved(vertices)


def _brought_back(
    vertices: np.ndarray, chosen: np.ndarray, adjacency: sparse.csr_matrix, source: VisibleSource, length: float
) -> np.ndarray:
    """(R, 3) vertices with the chosen ones on the source where it is nearest to the membrane between their neighbors."""
    places = spanned(adjacency, vertices, chosen)
    closest, goal = source.surface.query(places), vertices.copy()
    goal[chosen] = np.where((closest.distances < REACH * length)[:, None], closest.points, places)
    return goal


def _small_patches(adjacency: sparse.csr_matrix, out: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`connected_patches` of the (R,) bool `out` with at most LARGEST vertices, and fewer than the piece of the mesh that they are on."""
    chosen, patches = connected_patches(adjacency, out)
    count = np.bincount(patches, minlength=1)
    bordered = np.bincount(patches, (adjacency[chosen] @ ~out) > 0, minlength=1) > 0
    kept = ((count <= LARGEST) & bordered)[patches]
    return chosen[kept], np.unique(patches[kept], return_inverse=True)[1]


def _highest(heights: np.ndarray, patches: np.ndarray) -> np.ndarray:
    """(P,) greatest height in each patch."""
    result = np.zeros(patches.max(initial=-1) + 1)
    np.maximum.at(result, patches, heights)
    return result
