"""A smooth offset along normals: what it reproduces, what it smooths away, and what it leaves alone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.geometry.mesh import vertex_normals
from refmesh_addon.core.reference.detail import moved_along_normals

from ..shapes import ball, joined, moved

BALL = ball()
ALL = np.arange(len(BALL.vertices))


def test_an_even_offset_is_taken_in_full():
    targets = BALL.vertices + 0.1 * vertex_normals(BALL)
    assert_allclose(moved_along_normals(BALL, ALL, targets, 0.3), targets, atol=2e-4)


def test_targets_aside_do_not_slide_a_vertex():
    normals = vertex_normals(BALL)
    aside = np.cross(normals, [0.3, 0.2, 0.9])
    assert_allclose(moved_along_normals(BALL, ALL, BALL.vertices + aside, 0.3), BALL.vertices, atol=1e-12)


def test_the_finer_the_detail_the_less_of_it_is_kept():
    normals, height = vertex_normals(BALL), BALL.vertices[:, 2]
    kept = []
    for waves in (2.0, 6.0, 18.0):
        offset = 0.05 * np.cos(waves * height)
        move = moved_along_normals(BALL, ALL, BALL.vertices + offset[:, None] * normals, 0.1) - BALL.vertices
        result = np.einsum("ij,ij->i", move, normals)
        kept.append(np.dot(result, offset) / np.dot(offset, offset))
    assert kept == sorted(kept, reverse=True)
    assert kept[0] > 0.95 and kept[-1] < 0.5


def test_where_there_is_no_target_the_offset_runs_on_and_bodies_without_any_stay():
    other = moved(BALL, shift=(5.0, 0, 0))
    chosen = np.flatnonzero(BALL.vertices[:, 2] > 0)
    result = moved_along_normals(joined(BALL, other), chosen, 1.1 * BALL.vertices[chosen], 0.3)
    assert_array_equal(result[len(ALL) :], other.vertices)
    reach = np.linalg.norm(result[ALL], axis=1)
    assert reach.min() > 1.02 and reach.max() < 1.101


@pytest.mark.parametrize("scale", [1e-4, 1e4])
def test_the_unit_of_length_does_not_matter(scale):
    rng = np.random.default_rng(0)
    targets = BALL.vertices * (1 + 0.1 * rng.random((len(ALL), 1)))
    plain = moved_along_normals(BALL, ALL, targets, 0.2)
    assert_allclose(moved_along_normals(moved(BALL, scale=scale), ALL, scale * targets, scale * 0.2), scale * plain, atol=1e-9 * scale)
