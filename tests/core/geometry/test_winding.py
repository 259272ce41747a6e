"""Winding numbers: inside, outside, overlaps and cavities, whatever the triangles."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from refmesh_addon.core.geometry import winding
from refmesh_addon.core.geometry.winding import Winding, enclosed_by
from refmesh_addon.core.types import TriangleMesh
from tests.core.shapes import ball, box, joined

POINTS = np.random.default_rng(0).uniform(-1.2, 1.2, (4000, 3))


def in_box(points, middle=0.0, half=0.5):
    return (np.abs(points - middle) < half).all(axis=1)


@pytest.mark.parametrize("subdivisions", [0, 4])
def test_a_box_winds_once_around_its_inside(subdivisions):
    assert_array_equal(Winding(box((1.0,) * 3, subdivisions)).of(POINTS), in_box(POINTS).astype(int))


def test_overlaps_count_twice_and_cavities_not_at_all():
    middles = np.array([[0.0, 0.0, 0.0], [0.3, 0.2, 0.1]])
    two = joined(*(box((1.0,) * 3, 3, tuple(middle)) for middle in middles))
    assert_array_equal(Winding(two).of(POINTS), sum(in_box(POINTS, middle).astype(int) for middle in middles))
    small = box((0.6,) * 3, 2)
    hollow = joined(box((1.0,) * 3, 3), TriangleMesh(small.vertices, small.triangles[:, ::-1]))
    assert_array_equal(Winding(hollow).of(POINTS), in_box(POINTS).astype(int) - in_box(POINTS, half=0.3))


def test_turning_over_scaling_and_shifting():
    mesh = ball(4)
    result = Winding(mesh).of(POINTS)
    assert 0 < result.sum() < len(POINTS)
    assert_array_equal(Winding(TriangleMesh(mesh.vertices, mesh.triangles[:, ::-1])).of(POINTS), -result)
    assert_array_equal(Winding(mesh.moved(1000 * mesh.vertices + 5e4)).of(1000 * POINTS + 5e4), result)


def test_batches_do_not_matter(monkeypatch):
    mesh = ball(4)
    result = Winding(mesh).of(POINTS)
    monkeypatch.setattr(winding, "PAIRS_AT_ONCE", 50)
    assert_array_equal(Winding(mesh).of(POINTS), result)
    assert Winding(mesh).of(np.empty((0, 3))).shape == (0,)


def test_a_capture_with_a_hole_and_seams_encloses_what_it_would_without():
    whole = ball(4)
    torn = TriangleMesh(whole.vertices[whole.triangles].reshape(-1, 3), np.arange(3 * len(whole.triangles)).reshape(-1, 3))
    top = (torn.vertices[torn.triangles][:, :, 2] > 0.9).all(axis=1)
    open_ball = TriangleMesh(torn.vertices, torn.triangles[~top])
    cap = POINTS[:, 2] > 0.85
    assert_array_equal(enclosed_by(open_ball)(POINTS)[~cap], enclosed_by(whole)(POINTS)[~cap])
    assert not enclosed_by(open_ball)(np.array([[0.0, 0.0, 0.98]])).any()
