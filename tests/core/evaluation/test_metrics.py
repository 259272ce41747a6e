"""Distances that can be worked out by hand, and what must not change them."""

import json
from dataclasses import asdict

import numpy as np
import pytest
from numpy.testing import assert_allclose

from refmesh_addon.core.evaluation.metrics import measure, source_distances, surface_distance
from refmesh_addon.core.evaluation.psnr import PSNR_CEILING
from refmesh_addon.core.types import TriangleMesh


def square(cells=8, height=0.0, tilt=0.0):
    x, y = np.meshgrid(np.linspace(0, 1, cells + 1), np.linspace(0, 1, cells + 1), indexing="ij")
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3)
    return TriangleMesh(np.stack([x, y, np.full_like(x, height) + tilt * x], axis=2).reshape(-1, 3), triangles)


def rng():
    return np.random.default_rng(11)


def test_a_lifted_square_is_everywhere_as_far_as_it_was_lifted():
    result = surface_distance(square(), square(5, height=0.03), 2000, rng())
    share = 0.03 / np.sqrt(2)
    for side in (result.source_to_deformed, result.deformed_to_source):
        assert_allclose([side.mean, side.rms, side.p99, side.max], share, rtol=1e-9)
    assert_allclose(result.d2_psnr, 20 * np.log10(np.sqrt(2) / 0.03), rtol=1e-9)
    assert result.d1_psnr < result.d2_psnr


def test_a_tilted_square_has_the_moments_of_a_ramp():
    steep = 0.01
    result = surface_distance(square(), square(tilt=steep), 200_000, rng())
    # distance to the ramp grows from 0 to `steep` along x, but for cos(steep) and the last strip
    share = result.source_to_deformed
    assert_allclose(share.mean * np.sqrt(2), steep / 2, rtol=0.01)
    assert_allclose(share.rms * np.sqrt(2), steep / np.sqrt(3), rtol=0.01)
    assert_allclose(share.p99 * np.sqrt(2), 0.99 * steep, rtol=0.01)
    assert_allclose(share.max * np.sqrt(2), steep, rtol=0.01)


def test_a_missing_half_is_seen_from_one_side_only():
    whole = square()
    half = TriangleMesh(whole.vertices, whole.triangles[whole.vertices[whole.triangles][:, :, 0].max(axis=1) <= 0.5])
    result = surface_distance(whole, half, 20_000, rng())
    assert_allclose(result.deformed_to_source.max, 0, atol=1e-15)
    assert_allclose(result.source_to_deformed.max * np.sqrt(2), 0.5, rtol=0.01)
    assert_allclose(result.source_to_deformed.mean * np.sqrt(2), 0.125, rtol=0.03)


def test_distances_from_the_source_alone_are_those_of_both_sides():
    source, deformed = square(), square(height=0.02, tilt=0.1)
    assert source_distances(source, deformed, 500) == measure(source, deformed, 500).distances.source_to_deformed


def test_psnr_is_the_worse_of_the_two_directions():
    whole = square()
    half = TriangleMesh(whole.vertices, whole.triangles[whole.vertices[whole.triangles][:, :, 0].max(axis=1) <= 0.5])
    there, back = (surface_distance(a, b, 5000, rng()) for a, b in ((whole, half), (half, whole)))
    # point-to-point error of the missing half: mean square 1/24 over the whole square
    assert_allclose(there.d1_psnr, 10 * np.log10(2 * 24), atol=0.2)
    assert_allclose(back.d1_psnr - there.d1_psnr, 20 * np.log10(half.diagonal / whole.diagonal), atol=0.3)


def test_swapping_the_surfaces_swaps_the_sides():
    low, high = square(), square(tilt=0.2)
    there, back = surface_distance(low, high, 30_000, rng()), surface_distance(high, low, 30_000, rng())
    assert_allclose(there.source_to_deformed.mean * low.diagonal, back.deformed_to_source.mean * high.diagonal, rtol=0.02)
    assert_allclose(there.deformed_to_source.rms * low.diagonal, back.source_to_deformed.rms * high.diagonal, rtol=0.02)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scaling_both_surfaces_changes_no_figure(scale):
    low, high = square(), square(tilt=0.2)
    plain = asdict(surface_distance(low, high, 3000, rng()))
    scaled = asdict(surface_distance(low.moved(scale * low.vertices), high.moved(scale * high.vertices), 3000, rng()))
    for name in ("source_to_deformed", "deformed_to_source"):
        assert_allclose(list(scaled[name].values()), list(plain[name].values()), rtol=1e-9)
    assert_allclose([scaled["d1_psnr"], scaled["d2_psnr"]], [plain["d1_psnr"], plain["d2_psnr"]], rtol=1e-9)


def test_the_same_surface_gives_figures_that_json_can_hold():
    result = surface_distance(square(), square(3), 1000, rng())
    assert result.source_to_deformed.max < 1e-15
    assert result.d2_psnr == PSNR_CEILING
    assert 20 < result.d1_psnr < PSNR_CEILING  # the floor of two clouds on one surface
    assert json.loads(json.dumps(asdict(result), allow_nan=False)) == asdict(result)


def test_the_same_seed_gives_the_same_figures():
    assert surface_distance(square(), square(tilt=0.1), 500, rng()) == surface_distance(square(), square(tilt=0.1), 500, rng())


def test_a_mesh_without_area_is_refused():
    flat = TriangleMesh(np.zeros((3, 3)), [[0, 1, 2]])
    with pytest.raises(ValueError, match="area"):
        surface_distance(square(), flat, 100, rng())


def test_vertex_error_is_the_distance_of_each_vertex():
    ramp = square(tilt=0.5)
    errors = measure(square(), ramp, 500).errors
    assert_allclose(errors * square().diagonal, ramp.vertices[:, 2], atol=1e-12)
