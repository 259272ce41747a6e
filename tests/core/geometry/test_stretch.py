"""Stretch of triangles: known maps, a slow twin, and what leaves it alone."""

import numpy as np
from numpy.testing import assert_allclose

from refmesh_addon.core.geometry.stretch import STRETCHED, RestShape
from refmesh_addon.core.types import TriangleMesh

from ..shapes import TILT, ball

FLAT = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])


def test_a_map_of_the_plane_stretches_by_its_larger_singular_value():
    matrix = np.array([[1.5, 0.8, 0.0], [-0.3, 2.0, 0.0], [0.0, 0.0, 1.0]])
    moved = FLAT.vertices @ matrix.T @ TILT.T + [3, 4, 5]
    largest = np.linalg.svd(matrix[:2, :2], compute_uv=False)[0]
    assert_allclose(RestShape(FLAT).stretches(moved), largest)


def test_same_as_the_singular_values_of_each_triangle():
    mesh, rng = ball(2), np.random.default_rng(0)
    moved = mesh.vertices + 0.2 * rng.standard_normal(mesh.vertices.shape)
    expected = []
    for a, b, c in mesh.triangles:
        rest, now = (np.column_stack([at[b] - at[a], at[c] - at[a]]) for at in (mesh.vertices, moved))
        expected.append(np.linalg.norm(now @ np.linalg.pinv(rest), 2))
    assert_allclose(RestShape(mesh).stretches(moved), expected, rtol=1e-9)


def test_rigid_motions_and_the_size_of_the_whole_take_change_nothing():
    mesh = ball(2)
    assert_allclose(RestShape(mesh).stretches(mesh.vertices @ TILT.T + 1.0), 1.0)
    assert RestShape(mesh).overstretched(mesh.vertices) == 0.0
    longer = mesh.vertices * [4.0, 1.0, 1.0]
    scaled = mesh.moved(mesh.vertices * 1e-3)
    assert_allclose(RestShape(scaled).stretches(longer * 1e-3), RestShape(mesh).stretches(longer))


def test_overstretched_surface_counts_by_its_area_as_it_is():
    pulled = FLAT.vertices.copy()
    pulled[3] = [0, 2 * STRETCHED, 0]  # of the two triangles only the second, which now has 2 * STRETCHED times its area
    assert_allclose(RestShape(FLAT).overstretched(pulled), 2 * STRETCHED / (2 * STRETCHED + 1))


def test_a_triangle_without_area_stretches_without_end_but_to_no_nan():
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    assert np.isfinite(RestShape(mesh).stretches(np.eye(3))).all()
