from dataclasses import replace

import numpy as np
import pytest

from refmesh_addon.core.compression.morph_targets import (
    Courses,
    fitted_morph_targets,
    mean_normals,
    morph_targets,
    packed_bits,
    rms_along_normals,
)
from refmesh_addon.core.geometry.mesh import vertex_normals
from tests.core import shapes

BALL = shapes.ball(3)


def swinging(frames):
    """Two independent motions: a ball grows along x and shears."""
    x, y, z = BALL.vertices.T
    return np.stack([np.stack([x * (1 + 0.1 * f), y + 0.3 * np.sin(f) * x, z], axis=1) for f in range(frames)])


def test_two_motions_need_two_targets():
    frames = swinging(6)
    model = morph_targets(Courses.of(frames, BALL.triangles), 1e-5, 5)
    assert len(model.targets) == 2
    np.testing.assert_allclose(model.frames(), frames, atol=3e-5)


def test_weights_lie_within_zero_and_one_and_reach_both():
    model = morph_targets(Courses.of(swinging(6), BALL.triangles), 1e-4, 2)
    np.testing.assert_allclose(model.weights.min(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(model.weights.max(axis=0), 1.0, atol=1e-12)


def test_numbers_are_whole_and_positions_are_not_negative():
    model = morph_targets(Courses.of(swinging(4), BALL.triangles), 1e-3, 2)
    assert model.base.dtype == model.targets.dtype == np.int64
    np.testing.assert_array_equal(model.base.min(axis=0), 0)


@pytest.mark.parametrize("frames", [swinging(1), np.repeat(BALL.vertices[None], 5, axis=0)])
def test_what_stands_still_has_no_target(frames):
    model = morph_targets(Courses.of(frames, BALL.triangles), 1e-4, 3)
    assert model.targets.shape == (0, *BALL.vertices.shape) and model.weights.shape == (len(frames), 0)
    np.testing.assert_allclose(model.frames(), frames, atol=1.6e-4)


def test_the_error_asked_for_is_kept_and_reported():
    frames = swinging(8) + 0.01 * np.random.default_rng(1).standard_normal((8, *BALL.vertices.shape))
    model = fitted_morph_targets(Courses.of(frames, BALL.triangles), 0.012, range(1, 9))
    normals = np.stack([vertex_normals(BALL.moved(frame)) for frame in frames])
    along = ((model.frames() - frames) * normals).sum(axis=2)
    assert model.error <= 0.012
    assert np.sqrt((along**2).mean()) == pytest.approx(model.error, rel=0.1)


def test_where_the_error_cannot_be_reached_the_closest_is_taken():
    frames = np.random.default_rng(2).standard_normal((6, *BALL.vertices.shape)) + BALL.vertices
    model = fitted_morph_targets(Courses.of(frames, BALL.triangles), 1e-3, range(1, 3))
    assert len(model.targets) == 2 and model.error > 1e-3


def test_the_error_is_that_along_the_normals():
    frames = swinging(5)
    model = morph_targets(Courses.of(frames, BALL.triangles), 0.02, 1)
    assert model.error == pytest.approx(rms_along_normals(model.frames(), frames, BALL.triangles), rel=1e-12)


def test_rate_distortion_rounding_costs_fewer_bits_at_the_same_error():
    frames = swinging(8) + 0.01 * np.sin(9 * swinging(8))
    courses = Courses.of(frames, BALL.triangles)
    model = morph_targets(courses, 0.02, 4)
    finer = [plainly_rounded(courses, unit, 4) for unit in (0.02, 0.016, 0.012, 0.01, 0.008)]
    assert packed_bits(model) < 0.9 * min(packed_bits(other) for other in finer if other.error <= model.error)


def plainly_rounded(courses, unit, count):
    """Each number to the nearest whole one."""
    exact = morph_targets(courses, 1e-6, count)
    whole = (np.rint(1e-6 * shapes_ / unit).astype(np.int64) for shapes_ in (exact.base, exact.targets))
    rough = type(exact)(*whole, exact.weights, exact.origin, unit, 0.0)
    return replace(rough, error=courses.error(rough.frames()))


def test_mean_normals_of_a_ball_point_outward():
    assert ((mean_normals(BALL.vertices[None], BALL.triangles) * BALL.vertices).sum(axis=1) > 0.99).all()
