"""Raggedness of rims: zero for closed surfaces, near it for round holes, larger for notches, the same at any scale."""

import numpy as np
import pytest

from refmesh_addon.core.capture.rims import rim_excess

from ..shapes import TILT, ball, joined, moved, without


def opened(notched=False):
    """A ball without the triangles near its pole, and without every other part of the ring around these."""
    whole = ball(4)
    middles = whole.vertices[whole.triangles].mean(axis=1)
    away = middles[:, 2] > 0.8
    if notched:
        away |= (middles[:, 2] > 0.6) & (np.sin(6 * np.arctan2(middles[:, 1], middles[:, 0])) > 0)
    return without(whole, away)


def test_closed_surface_has_no_rims():
    assert rim_excess(ball(2)) == 0.0


def test_round_hole_is_clean_and_a_notched_one_is_not():
    assert 0 < 4 * rim_excess(opened()) < rim_excess(opened(notched=True))


def test_is_the_same_at_any_scale_and_place():
    mesh = opened(notched=True)
    assert rim_excess(moved(mesh, TILT, (5e4, -2e4, 7.0), 1e3)) == pytest.approx(rim_excess(mesh), rel=1e-6)


def test_rims_of_several_holes_add_up():
    one = opened()
    assert rim_excess(joined(one, moved(one, shift=(10.0, 0.0, 0.0)))) == pytest.approx(np.sqrt(2) * rim_excess(one), rel=1e-9)
