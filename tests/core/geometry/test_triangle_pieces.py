"""Pieces of large triangles cover them, and their spheres hold them."""

import numpy as np
from numpy.testing import assert_allclose

from refmesh_addon.core.geometry.triangle_pieces import COARSEST, bisected, longest_edge_first, smallest_spheres

from ..shapes import ball, box, joined

MESH = joined(ball(3, 0.6), box(), box((1e-3, 1.0, 2.0), center=(5.0, 0.0, 0.0)))
AXES = np.ascontiguousarray(MESH.vertices.T)
TRIANGLES, LONGEST = longest_edge_first(AXES, MESH.triangles.T)


def areas(axes, triangles):
    a, b, c = axes.T[triangles]
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def test_the_longest_edge_joins_the_first_two_corners_and_the_orientation_stays():
    a, b, c = MESH.vertices[TRIANGLES]
    lengths = np.stack([np.linalg.norm(end - start, axis=1) for start, end in ((a, b), (b, c), (c, a))])
    assert_allclose(LONGEST, lengths.max(axis=0))
    assert_allclose(lengths[0], LONGEST)
    corners = MESH.vertices[MESH.triangles]
    assert_allclose(np.cross(b - a, c - a), np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), atol=1e-12)


def test_pieces_are_small_and_have_the_area_of_their_triangle():
    pieces = bisected(AXES, TRIANGLES, LONGEST)
    assert pieces.longest.max() <= COARSEST * np.median(LONGEST)
    of_pieces = np.bincount(pieces.owners, areas(pieces.nodes, pieces.corners), len(LONGEST))
    assert_allclose(of_pieces, areas(AXES, TRIANGLES))


def test_spheres_hold_their_corners_and_are_no_larger_than_they_must():
    spheres, corners = smallest_spheres(AXES, TRIANGLES), MESH.vertices[TRIANGLES]
    distances = np.linalg.norm(corners - spheres[:3].T, axis=2)
    assert_allclose(distances.max(axis=0), spheres[3])
    assert (np.sum(distances > spheres[3] * (1 - 1e-9), axis=0) >= 2).all(), "two or three corners lie on it"
    assert (spheres[3] <= LONGEST / np.sqrt(3) * (1 + 1e-9)).all(), "Jung's theorem"
