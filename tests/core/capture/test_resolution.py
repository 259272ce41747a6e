"""The triangles that a surface needs: few for flat faces, as many as the curvature asks for on a ball, the same in any unit."""

import numpy as np
import pytest

from refmesh_addon.core.capture.resolution import ERROR, needed_triangles

from ..shapes import TILT, ball, box, joined, moved


def test_flat_faces_need_few_however_they_are_meshed():
    counts = [needed_triangles(moved(box(subdivisions=level), TILT)) for level in range(5)]
    assert max(counts) == min(counts) < 10_000


@pytest.mark.parametrize("subdivisions", [3, 4])
def test_a_ball_needs_what_keeps_its_chords_near(subdivisions):
    edge = np.sqrt(8 * ERROR * 2 * np.sqrt(3) / 2)  # for the sum of both curvatures, 2 on a unit ball
    assert needed_triangles(ball(subdivisions)) == pytest.approx(4 * np.pi / (np.sqrt(3) / 4 * edge**2), rel=0.15)


def test_the_most_curved_body_decides_and_units_do_not():
    both = joined(box((4, 4, 1), subdivisions=2), moved(ball(3), shift=(0, 0, 3)))
    assert needed_triangles(both) > 30_000
    assert needed_triangles(moved(both, scale=1000.0)) == pytest.approx(needed_triangles(both), abs=1)


def test_a_surface_without_area_needs_none():
    assert needed_triangles(moved(box(), scale=0.0)) == 0
