"""What surrounds the reconstruction: points, depth, and bubbles."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry.mesh import is_watertight, triangle_areas, triangle_normals, vertex_components
from refmesh_addon.core.reference.budget import LEAST_TRIANGLES, NEAR, oriented_points, supported, triangle_budget
from refmesh_addon.core.surfacing.reconstruction import DEPTHS, reconstruction_depth

from ..shapes import TILT, above, ball, box, joined, moved, torus


def test_points_lie_on_the_triangles_that_count_and_face_their_way():
    mesh = moved(box(subdivisions=2), TILT)
    whole = above(mesh, -0.2)
    points, normals = oriented_points(mesh, whole, 500, np.random.default_rng(0))
    corners, facing = mesh.vertices[mesh.triangles[whole]], triangle_normals(mesh)[whole]
    assert points.shape == normals.shape == (500, 3)
    for point, normal in zip(points, normals):
        own = np.flatnonzero((np.abs(facing - normal) < 1e-12).all(axis=1))
        a, b, c = corners[own].transpose(1, 0, 2)
        area = triangle_areas(mesh)[whole][own]
        shares = np.stack([np.linalg.norm(np.cross(p - point, q - point), axis=1) / 2 for p, q in ((a, b), (b, c), (c, a))])
        assert np.abs(shares.sum(axis=0) / area - 1).min() < 1e-9, "inside one of the triangles with that normal"


def test_points_are_spread_by_area_and_follow_the_generator():
    mesh = joined(box((1, 1, 1)), box((2, 2, 2), center=(5, 0, 0)))
    everything = np.ones(len(mesh.triangles), dtype=bool)
    points, _ = oriented_points(mesh, everything, 4000, np.random.default_rng(0))
    assert np.mean(points[:, 0] > 2) == pytest.approx(0.8, abs=0.03)
    assert_array_equal(oriented_points(mesh, everything, 4000, np.random.default_rng(0))[0], points)


@pytest.mark.parametrize("mesh", [ball(), box(), torus()])
def test_depth_has_no_unit_and_grows_with_the_budget(mesh):
    budgets = [100, 1000, 5000, 20_000, 100_000, 1_000_000]
    depths = [reconstruction_depth(mesh, budget) for budget in budgets]
    assert depths == sorted(depths)
    assert depths[0] >= DEPTHS[0] and depths[-1] <= DEPTHS[1]
    assert len(set(depths)) > 3
    for change in ({"scale": 1e-3}, {"scale": 10.0}, {"shift": (1e3, 0.0, -1e3)}):
        assert [reconstruction_depth(moved(mesh, **change), budget) for budget in budgets] == depths


def test_depth_leaves_more_cells_on_the_surface_than_the_budget_but_not_many_more():
    mesh = ball(4)
    for budget in (5000, 20_000, 80_000):
        depth = reconstruction_depth(mesh, budget)
        cell = 1.1 * 2.0 / 2**depth
        expected = 2 * triangle_areas(mesh).sum() / cell**2
        assert budget < expected < 8 * budget


def test_bubbles_go_and_bodies_stay():
    body, other, bubble = ball(2), ball(2, 0.5, (3, 0, 0)), ball(1, 0.3, (0, 5, 0))
    points = np.concatenate([body.vertices, other.vertices + 0.05])
    kept = supported(joined(body, bubble, other), points, 0.4)
    expected = joined(body, other)
    assert_array_equal(kept.vertices, expected.vertices)
    assert_array_equal(kept.triangles, expected.triangles)
    assert is_watertight(kept)
    assert vertex_components(kept)[0] == 2


@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_what_is_too_small_to_hold_a_center_goes_though_points_lie_on_it(scale):
    body, sliver = moved(ball(2), scale=scale), moved(ball(2, 0.1, (3, 0, 0)), scale=scale)
    points = np.concatenate([body.vertices, sliver.vertices])
    assert vertex_components(supported(joined(body, sliver), points, 0.2 * scale))[0] == 2
    assert vertex_components(supported(joined(body, sliver), points, 0.5 * scale))[0] == 1
    assert vertex_components(supported(joined(body, sliver), points, 9.0 * scale))[0] == 1


def test_a_body_stays_when_a_part_of_it_has_no_points():
    body = ball(3)
    points = body.vertices[body.vertices[:, 2] > -0.6]  # a hole that the reconstruction closed
    assert_array_equal(supported(body, points, 0.2).triangles, body.triangles)


def test_support_reaches_a_share_of_the_spacing():
    body = ball(1)
    for spacing in (1e-3, 1.0, 1e3):
        scaled = moved(body, scale=spacing)
        near, far = (scaled.vertices + np.array([share * spacing, 0, 0]) for share in (0.9 * NEAR, 40.0))
        assert len(supported(scaled, near, spacing).triangles) == len(body.triangles)
        assert not len(supported(scaled, far, spacing).triangles)


def test_supported_twice_is_supported_once():
    mesh = joined(ball(2), ball(1, 0.3, (0, 5, 0)))
    once = supported(mesh, ball(2).vertices, 0.2)
    again = supported(once, ball(2).vertices, 0.2)
    assert_allclose(again.vertices, once.vertices)
    assert_array_equal(again.triangles, once.triangles)


@pytest.mark.parametrize("asked, captured, expected", [(0, [30_000, 50_000, 40_000], 40_000), (0, [600], LEAST_TRIANGLES), (600, [9], 600)])
def test_triangles_are_as_many_as_asked_for_or_as_captured_but_enough_to_fit(asked, captured, expected):
    assert triangle_budget(asked, captured) == expected
