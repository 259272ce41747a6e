"""Tears: which triangles span one, and what is left closed."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry.mesh import is_watertight
from refmesh_addon.core.reference.tears import TORN_LENGTH, TORN_RATIO, Tears, torn
from refmesh_addon.core.types import TriangleMesh

from ..shapes import TILT, ball, moved


@pytest.mark.parametrize("seed", range(3))
def test_torn_triangles_against_a_plain_twin(seed):
    mesh = moved(ball(2), TILT)
    mapped = mesh.vertices + 0.3 * np.random.default_rng(seed).normal(size=mesh.vertices.shape)
    expected = []
    for triangle in mesh.triangles:
        sides = [(triangle[k], triangle[(k + 1) % 3]) for k in range(3)]
        lengths = [[np.linalg.norm(points[a] - points[b]) for a, b in sides] for points in (mesh.vertices, mapped)]
        expected.append(any(now > TORN_RATIO * was and now - was > TORN_LENGTH * 0.5 for was, now in zip(*lengths)))
    assert 0 < sum(expected) < len(expected)
    assert_array_equal(torn(mesh, mapped, 0.5), expected)


def test_holes_of_the_mesh_are_capped_though_nothing_tears():
    whole = ball(2)
    with_hole = TriangleMesh(whole.vertices, whole.triangles[1:])
    tears = Tears(with_hole, 0.5)
    closed = tears.closed(with_hole, tears.whole(with_hole.vertices))
    assert is_watertight(closed) and not is_watertight(with_hole)
    assert Tears(whole, 0.5).closed(whole, np.ones(len(whole.triangles), dtype=bool)) is whole
