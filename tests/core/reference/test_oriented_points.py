"""Oriented points: on the triangles that count, by area, facing their way."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry.mesh import triangle_areas, triangle_normals
from refmesh_addon.core.reference.oriented_points import oriented_points

from ..shapes import TILT, above, box, joined, moved


def test_points_lie_on_the_triangles_that_count_and_face_their_way():
    mesh = moved(box(subdivisions=2), TILT)
    whole = above(mesh, -0.2)
    points, normals, triangles = oriented_points(mesh, whole, 500, np.random.default_rng(0))
    corners, facing = mesh.vertices[mesh.triangles[whole]], triangle_normals(mesh)[whole]
    assert points.shape == normals.shape == (500, 3)
    assert_array_equal(triangle_normals(mesh)[triangles], normals)
    assert whole[triangles].all()
    for point, normal in zip(points, normals):
        own = np.flatnonzero((np.abs(facing - normal) < 1e-12).all(axis=1))
        a, b, c = corners[own].transpose(1, 0, 2)
        area = triangle_areas(mesh)[whole][own]
        shares = np.stack([np.linalg.norm(np.cross(p - point, q - point), axis=1) / 2 for p, q in ((a, b), (b, c), (c, a))])
        assert np.abs(shares.sum(axis=0) / area - 1).min() < 1e-9, "inside one of the triangles with that normal"


def test_points_are_spread_by_area_and_follow_the_generator():
    mesh = joined(box((1, 1, 1)), box((2, 2, 2), center=(5, 0, 0)))
    everything = np.ones(len(mesh.triangles), dtype=bool)
    points, _, _ = oriented_points(mesh, everything, 4000, np.random.default_rng(0))
    assert np.mean(points[:, 0] > 2) == pytest.approx(0.8, abs=0.03)
    assert_array_equal(oriented_points(mesh, everything, 4000, np.random.default_rng(0))[0], points)
