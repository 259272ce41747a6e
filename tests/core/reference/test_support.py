"""Components of a reconstruction: bubbles go, bodies stay."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry.mesh import is_watertight, vertex_components
from refmesh_addon.core.reference.support import NEAR, without_bubbles

from ..shapes import ball, joined, moved


def test_bubbles_go_and_bodies_stay():
    body, other, bubble = ball(2), ball(2, 0.5, (3, 0, 0)), ball(1, 0.3, (0, 5, 0))
    points = np.concatenate([body.vertices, other.vertices + 0.05])
    kept = without_bubbles(joined(body, bubble, other), points, 0.4)
    expected = joined(body, other)
    assert_array_equal(kept.vertices, expected.vertices)
    assert_array_equal(kept.triangles, expected.triangles)
    assert is_watertight(kept)
    assert vertex_components(kept)[0] == 2


@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_what_is_too_small_to_hold_a_center_goes_though_points_lie_on_it(scale):
    body, sliver = moved(ball(2), scale=scale), moved(ball(2, 0.1, (3, 0, 0)), scale=scale)
    points = np.concatenate([body.vertices, sliver.vertices])
    assert vertex_components(without_bubbles(joined(body, sliver), points, 0.2 * scale))[0] == 2
    assert vertex_components(without_bubbles(joined(body, sliver), points, 0.5 * scale))[0] == 1
    assert vertex_components(without_bubbles(joined(body, sliver), points, 9.0 * scale))[0] == 1


def test_a_body_stays_when_a_part_of_it_has_no_points():
    body = ball(3)
    points = body.vertices[body.vertices[:, 2] > -0.6]  # a hole that the reconstruction closed
    assert_array_equal(without_bubbles(body, points, 0.2).triangles, body.triangles)


def test_support_reaches_a_share_of_the_spacing():
    body = ball(1)
    for spacing in (1e-3, 1.0, 1e3):
        scaled = moved(body, scale=spacing)
        near, far = (scaled.vertices + np.array([share * spacing, 0, 0]) for share in (0.9 * NEAR, 40.0))
        assert len(without_bubbles(scaled, near, spacing).triangles) == len(body.triangles)
        assert not len(without_bubbles(scaled, far, spacing).triangles)


def test_done_twice_is_done_once():
    mesh = joined(ball(2), ball(1, 0.3, (0, 5, 0)))
    once = without_bubbles(mesh, ball(2).vertices, 0.2)
    again = without_bubbles(once, ball(2).vertices, 0.2)
    assert_allclose(again.vertices, once.vertices)
    assert_array_equal(again.triangles, once.triangles)
