import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.geometry.mesh import is_watertight, signed_volume, vertex_components
from refmesh_addon.core.geometry.self_intersection import crossing_triangles
from refmesh_addon.core.surfacing.reconstruction import screened_poisson

from ..bodies import BODIES, distance, oriented_points

DEPTH = 5
bodies = pytest.mark.parametrize("body", BODIES.values(), ids=BODIES.keys())


@bodies
def test_a_reconstruction_is_closed_faces_outward_and_lies_on_the_points(body):
    result = screened_poisson(*oriented_points(body), DEPTH)
    cell = 1.1 * np.ptp(body.vertices, axis=0).max() / 2**DEPTH
    assert is_watertight(result)
    assert vertex_components(result)[0] == vertex_components(body)[0]
    assert signed_volume(result) == pytest.approx(signed_volume(body), rel=0.02)
    assert distance(result, body) < 0.1 * cell
    assert not crossing_triangles(result).any()


def test_a_hole_in_the_points_is_closed():
    points, normals = oriented_points(BODIES["ball"])
    kept = points[:, 2] > -0.9
    result = screened_poisson(points[kept], normals[kept], DEPTH)
    assert is_watertight(result)
    assert signed_volume(result) == pytest.approx(signed_volume(BODIES["ball"]), rel=0.04)


def test_a_thin_gap_between_stray_layers_inside_leaves_no_hollow():
    """As frames leave it that place a fold differently: two small layers that face each other, nearer than a cell."""
    points, normals = oriented_points(BODIES["ball"])
    cell, rng = 2.2 / 2**DEPTH, np.random.default_rng(0)
    layer = np.column_stack([rng.uniform(-2.5, 2.5, (60, 2)), np.repeat([-0.3, 0.3], 30)]) * cell
    inward = np.column_stack([np.zeros((60, 2)), -np.sign(layer[:, 2])])
    result = screened_poisson(np.concatenate([points, layer]), np.concatenate([normals, inward]), DEPTH)
    assert vertex_components(result)[0] == 1


def test_a_real_hollow_is_kept():
    points, normals = oriented_points(BODIES["ball"])
    result = screened_poisson(np.concatenate([points, 0.4 * points]), np.concatenate([normals, -normals]), DEPTH)
    assert vertex_components(result)[0] == 2
    assert signed_volume(result) == pytest.approx((1 - 0.4**3) * signed_volume(BODIES["ball"]), rel=0.03)


def test_noise_is_averaged():
    """Points a third of a cell off on either side give a surface that is much nearer to the truth than they are."""
    body, rng = BODIES["ball"], np.random.default_rng(1)
    points, normals = oriented_points(body, 20_000)
    noise = rng.normal(0, 0.33 * 2.2 / 2**DEPTH, len(points))
    result = screened_poisson(points + noise[:, None] * normals, normals, DEPTH)
    assert distance(result, body) < 0.3 * np.abs(noise).mean()


def test_uneven_density_does_not_bend_the_surface():
    """Twenty times as many points on one half: each counts for the area that it stands for."""
    body = BODIES["ball"]
    points, normals = oriented_points(body, 40_000)
    kept = (points[:, 0] > 0) | (np.arange(len(points)) % 20 == 0)
    result = screened_poisson(points[kept], normals[kept], DEPTH)
    assert signed_volume(result) == pytest.approx(signed_volume(body), rel=0.02)
    assert distance(result, body) < 0.15 * 2.2 / 2**DEPTH


def test_depth_refines_fourfold():
    coarse, fine = (len(screened_poisson(*oriented_points(BODIES["torus"], 8000), depth).triangles) for depth in (4, 5))
    assert 3 < fine / coarse < 5


@pytest.mark.parametrize(("scale", "shift"), [(1e-3, 0.0), (10.0, 0.0), (1.0, 1e4)])
def test_a_reconstruction_scales_and_moves_with_its_points(scale, shift):
    points, normals = oriented_points(BODIES["torus"])
    plain = screened_poisson(points, normals, DEPTH)
    result = screened_poisson(scale * points + shift, normals, DEPTH)
    assert_array_equal(result.triangles, plain.triangles)
    assert_allclose(result.vertices, scale * plain.vertices + shift, atol=1e-5 * scale)


def test_the_same_points_give_the_same_bytes():
    first, again = (screened_poisson(*oriented_points(BODIES["two balls"]), DEPTH) for _ in range(2))
    assert_array_equal(first.vertices, again.vertices)
    assert_array_equal(first.triangles, again.triangles)


@pytest.mark.parametrize("count", [0, 1, 5])
def test_points_that_give_no_surface_are_refused_in_words(count):
    with pytest.raises(RefMeshError, match="came out empty"):
        screened_poisson(np.zeros((count, 3)), np.ones((count, 3)), DEPTH)
