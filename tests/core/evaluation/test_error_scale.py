"""Colors of distances: both ends, order, and the way from sRGB to linear."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.evaluation.error_scale import TABLE, TOP, error_colors, to_linear


def test_the_ends_and_the_steps_of_the_scale_are_those_of_the_table():
    colors = error_colors(TOP * np.linspace(0, 1, len(TABLE)))
    assert_array_equal(colors[:, :3], np.rint(255 * TABLE))
    assert_array_equal(colors[:, 3], 255)
    assert colors.dtype == np.uint8


def test_beyond_the_scale_nothing_changes():
    assert_array_equal(error_colors(np.array([2 * TOP, 1.0, np.inf])), error_colors(np.full(3, TOP)))
    assert_array_equal(error_colors(np.array([-1.0])), error_colors(np.zeros(1)))
    assert error_colors(np.empty(0)).shape == (0, 4)


def test_lightness_rises_with_the_distance():
    linear = to_linear(error_colors(np.linspace(0, TOP, 100))[:, :3] / 255)
    luminance = linear @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) > -1e-4).all()
    steps = np.diff(np.cbrt(to_linear(TABLE) @ [0.2126, 0.7152, 0.0722]))
    assert steps.min() > 0.5 * steps.max(), "even to the eye"


def test_linear_values_are_those_of_the_standard():
    assert_allclose(to_linear(np.array([0.0, 0.04045, 0.5, 1.0])), [0.0, 0.0031308, 0.2140411, 1.0], atol=1e-6)
    values = np.linspace(0, 1, 50)
    linear = to_linear(values)
    back = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert_allclose(back, values, atol=1e-5)
