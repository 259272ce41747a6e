"""Figures of centers whose motion is known."""

import numpy as np
import pytest

from refmesh_addon.core.findings import CENTER_ATTRIBUTES
from refmesh_addon.core.tracking.center_attributes import center_attributes

GRID = np.stack(np.meshgrid(*[np.arange(4.0)] * 3), axis=-1).reshape(-1, 3)


def moving(shift: np.ndarray) -> np.ndarray:
    """Two blocks that touch at first; the second goes away."""
    second = GRID[:32] + [4.0, 0.0, 0.0]
    return np.stack([np.concatenate([GRID, second + step * shift]) for step in range(6)])


def test_bodies_are_what_stays_together():
    figures = center_attributes(moving(np.array([1.0, 0.0, 0.0])), 1.0)
    np.testing.assert_array_equal(figures["body"], [0] * 64 + [1] * 32)
    assert set(center_attributes(moving(np.zeros(3)), 1.0)["body"]) == {0}


def test_speed_is_the_step_in_spacings():
    speed = center_attributes(moving(np.array([0.0, 0.5, 0.0])), 1.0)["speed"]
    np.testing.assert_allclose(speed, [0.0] * 64 + [0.5] * 32)


def test_a_rigid_motion_has_no_error_and_a_stray_has_most():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    positions = np.stack([GRID, GRID @ turn + 3.0, GRID - 7.0])
    np.testing.assert_allclose(center_attributes(positions, 1.0)["error"], 0.0, atol=1e-12)
    positions[1, 21] += 0.5
    assert np.argmax(center_attributes(positions, 1.0)["error"]) == 21


def test_a_lonely_center_is_irregular():
    positions = np.stack([np.vstack([GRID, [[20.0, 0.0, 0.0]]])] * 2)
    assert np.argmax(center_attributes(positions, 1.0)["irregularity"]) == 64


@pytest.mark.parametrize("scale", [1e-3, 1e4])
def test_figures_do_not_depend_on_the_unit(scale):
    positions = moving(np.array([1.0, 0.2, 0.0]))
    expected, scaled = center_attributes(positions, 1.0), center_attributes(scale * positions, scale)
    assert set(expected) == set(CENTER_ATTRIBUTES)
    for name in CENTER_ATTRIBUTES:
        np.testing.assert_allclose(scaled[name], expected[name], rtol=1e-6, atol=1e-9)


def test_one_frame_and_one_center_pass():
    assert [figure.tolist() for figure in center_attributes(np.zeros((1, 1, 3)), 1.0).values()] == [[0], [0.0], [0.0], [0.0]]
