"""Weighted samples of a volume: conservation against all voxels, and a plain loop over blocks."""

from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from refmesh_addon.core.geometry.mesh import signed_volume
from refmesh_addon.core.geometry.voxels import fill, grid_around, grid_of
from refmesh_addon.core.tracking.volume import SAMPLES_PER_CENTER, TURN, sample_volume
from refmesh_addon.core.types import TriangleMesh

from ..shapes import QUARTER_TURN, TILT, ball, box, joined, moved, torus

BODY = moved(joined(torus(), box((0.9, 0.7, 0.5), center=(0.2, 0.1, 1.1))), TILT, (3.0, -2.0, 7.0))
RESOLUTION, CENTERS = 48, 20


def filled(mesh, resolution):
    """The turned grid, which of its voxels are filled, and what takes points of the grid to the scene."""
    turn, middle = Rotation.from_rotvec(TURN), mesh.vertices.mean(axis=0)
    turned = mesh.moved(turn.apply(mesh.vertices - middle, inverse=True))
    grid = grid_of(turned.vertices, grid_around(mesh.vertices, resolution).spacing)
    return grid, fill(turned, grid), lambda points: turn.apply(points) + middle


def test_every_level_keeps_the_mass_and_the_centroid_of_all_voxels():
    grid, inside, placed = filled(BODY, RESOLUTION)
    centroid = placed(grid.positions(inside).mean(axis=0))
    volume = sample_volume(BODY, RESOLUTION, CENTERS)
    assert len(volume.levels) == len(SAMPLES_PER_CENTER)
    for level in volume.levels:
        assert level.masses.sum() == np.count_nonzero(inside)
        assert_allclose(level.masses @ level.positions / level.masses.sum(), centroid, atol=1e-5 * grid.spacing)


def blocks_by_loop(grid, inside, factor):
    """Mass and centroid of each block, block after block."""
    blocks = []
    for corner in product(*(range(0, size, factor) for size in inside.shape)):
        cells = np.argwhere(inside[tuple(slice(start, start + factor) for start in corner)]) + corner
        if len(cells):
            blocks.append((len(cells), grid.origin + (cells.mean(axis=0) + 0.5) * grid.spacing))
    masses, centroids = zip(*blocks)
    return np.array(masses), np.array(centroids)


def test_blocks_same_as_a_loop():
    grid, inside, placed = filled(BODY, RESOLUTION)
    for level in sample_volume(BODY, RESOLUTION, CENTERS).levels:
        masses, centroids = blocks_by_loop(grid, inside, round(level.spacing / grid.spacing))
        assert_allclose(level.masses, masses)
        assert_allclose(level.positions, placed(centroids), atol=1e-5 * grid.spacing)


def test_levels_go_from_coarse_to_fine_and_hold_enough_samples():
    volume = sample_volume(BODY, RESOLUTION, CENTERS)
    counts = [len(level.positions) for level in volume.levels]
    assert counts == sorted(counts)
    assert all(
        count >= wanted * CENTERS or level.spacing == volume.voxel
        for count, wanted, level in zip(counts, SAMPLES_PER_CENTER, volume.levels)
    )
    assert [level.spacing for level in volume.levels] == sorted((level.spacing for level in volume.levels), reverse=True)
    assert volume.finest is volume.levels[-1]


def test_many_centers_get_every_voxel_by_itself():
    volume = sample_volume(BODY, RESOLUTION, 2000)
    grid, inside, placed = filled(BODY, RESOLUTION)
    assert volume.finest.spacing == grid.spacing
    assert_allclose(volume.finest.positions, placed(grid.positions(inside)))
    assert (volume.finest.masses == 1).all()


@pytest.mark.parametrize("mesh", [ball(3), moved(box(), TILT), moved(torus(), TILT)])
def test_the_size_is_the_enclosed_volume(mesh):
    volume = sample_volume(mesh, 64, 50)
    assert volume.size == pytest.approx(signed_volume(mesh), rel=0.01)
    assert volume.center_spacing(50) == pytest.approx((signed_volume(mesh) / 50) ** (1 / 3), rel=0.01)


@pytest.mark.parametrize("change", [{"scale": 1e-3}, {"scale": 10.0}, {"shift": (50.0, 20.0, -70.0)}])
def test_samples_move_and_scale_with_the_body(change):
    plain, changed = sample_volume(BODY, RESOLUTION, CENTERS), sample_volume(moved(BODY, **change), RESOLUTION, CENTERS)
    scale, shift = change.get("scale", 1.0), np.array(change.get("shift", (0.0, 0.0, 0.0)))
    assert changed.size == pytest.approx(scale**3 * plain.size, rel=1e-9)
    assert changed.voxel == pytest.approx(scale * plain.voxel, rel=1e-9)
    for before, after in zip(plain.levels, changed.levels, strict=True):
        assert_allclose(after.positions, scale * before.positions + shift, atol=1e-6 * changed.voxel)
        assert_allclose(after.masses, before.masses)


def test_a_quarter_turn_keeps_size_mass_and_turned_centroid():
    plain, turned = sample_volume(BODY, RESOLUTION, CENTERS), sample_volume(moved(BODY, QUARTER_TURN), RESOLUTION, CENTERS)
    assert turned.size == pytest.approx(plain.size, rel=0.003)
    middle, turned_middle = (v.finest.masses @ v.finest.positions / v.finest.masses.sum() for v in (plain, turned))
    assert_allclose(turned_middle, QUARTER_TURN @ middle, atol=0.1 * plain.voxel)


def test_faces_along_the_axes_are_in_their_place_to_a_fraction_of_a_voxel():
    resolution, voxel = 40, 2.0 / 40
    for share in np.linspace(0.0, 1.0, 8, endpoint=False):
        side = 1.0 + share * voxel  # a grid along the axes rounds it to whole voxels
        size = sample_volume(box((2.0, side, 1.2)), resolution, 50).size
        assert size / (2.0 * 1.2) == pytest.approx(side, abs=0.1 * voxel)


def test_too_few_voxels_are_refused_with_figures():
    with pytest.raises(ValueError, match="only 7 voxels lie inside at resolution 2, too few for 9 centers"):
        sample_volume(box((1.0, 1.0, 1.0)), 2, 9)


def test_a_sheet_is_refused():
    sheet = TriangleMesh(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) @ TILT.T, [[0, 1, 2], [0, 2, 3]])
    with pytest.raises(ValueError, match="only 0 voxels"):
        sample_volume(sheet, 32, 16)
