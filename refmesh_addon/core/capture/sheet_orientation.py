"""Consistent facing of the pieces of an open surface.

A body tells its outside by the volume that it encloses; a sheet does not. But one camera sees all pieces of a sheet from one side, so
their mean normals lie in one half-space, and most of the area in the file faces as it should.
"""

from __future__ import annotations

import numpy as np

from ..geometry.mesh import area_vectors, vertex_components
from ..types import TriangleMesh

ROUNDS = 10  # of flipping pieces until all agree; two or three are enough


def turned_pieces(mesh: TriangleMesh) -> np.ndarray:
    """(T,) bool, triangles of the connected pieces that face away from the side that the others are seen from.

    mesh : neighbors agree already. Of the two sides, the one that most of the area faces in the file counts.
    """
    count, label = vertex_components(mesh)
    piece = label[mesh.triangles[:, 0]]
    vectors = area_vectors(mesh)
    areas = np.bincount(piece, np.linalg.norm(vectors, axis=1), count)
    sums = np.stack([np.bincount(piece, axis, count) for axis in vectors.T], axis=1)
    signs = _agreeing(sums)
    if areas[signs < 0].sum() > areas[signs > 0].sum():
        signs = -signs
    return (signs < 0)[piece]


def _agreeing(sums: np.ndarray) -> np.ndarray:
    """(N,) of 1 and -1 that turn (N, 3) vectors into one half-space as well as possible: toward the axis that they scatter along most."""
    axis = np.linalg.eigh(sums.T @ sums)[1][:, -1]
    signs = np.where(sums @ axis < 0, -1.0, 1.0)
    for _ in range(ROUNDS):
        turned = np.where(sums @ (signs @ sums) < 0, -1.0, 1.0)
        if np.array_equal(turned, signs):
            break
        signs = turned
    return signs
