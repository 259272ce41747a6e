"""Lloyd's relaxation against dense loops, and the laws that make it a relaxation."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.tracking.lloyd import cells, centroids, spread
from refmesh_addon.core.tracking.ownership import Ownership
from refmesh_addon.core.tracking.volume import VolumeSamples, sample_volume

from ..shapes import TILT, ball, box, joined, moved, torus

BODY = moved(torus(), TILT)
CENTERS = 60


def volume_of(mesh, resolution=40, count=CENTERS):
    return sample_volume(mesh, resolution, count)


def random_centers(volume, count=CENTERS, seed=1):
    rng = np.random.default_rng(seed)
    return volume.finest.positions[rng.choice(len(volume.finest.positions), count, replace=False)] + 1e-3 * rng.normal(size=(count, 3))


def owned_by_loop(centers, samples):
    """For each center the samples that have no nearer one."""
    owner = np.array([np.argmin(np.linalg.norm(centers - q, axis=1)) for q in samples.positions])
    return [np.flatnonzero(owner == i) for i in range(len(centers))]


def test_cells_same_as_a_loop_over_all_pairs():
    samples = volume_of(BODY).levels[1]
    centers = random_centers(volume_of(BODY))
    fast, energy = cells(centers, Ownership(samples)), 0.0
    for i, own in enumerate(owned_by_loop(centers, samples)):
        mass, points = samples.masses[own], samples.positions[own]
        middle = mass @ points / mass.sum()
        assert fast.masses[i] == mass.sum()
        assert_allclose(fast.centroids[i], middle, atol=1e-12)
        assert_allclose(fast.second[i], sum(m * np.outer(q, q) for m, q in zip(mass, points - middle)) / mass.sum(), atol=1e-12)
        energy += mass @ np.sum((points - centers[i]) ** 2, axis=1)
    assert fast.energy == pytest.approx(energy / samples.masses.sum(), rel=1e-12)
    assert_array_equal(centroids(centers, Ownership(samples)), fast.centroids)


def test_cells_share_out_the_whole_volume():
    samples = volume_of(BODY).finest
    fast = cells(random_centers(volume_of(BODY)), Ownership(samples))
    assert fast.masses.sum() == samples.masses.sum()
    whole = samples.masses @ samples.positions / samples.masses.sum()
    assert_allclose(fast.masses @ fast.centroids / fast.masses.sum(), whole, atol=1e-12)
    assert fast.non_uniformity == pytest.approx(np.std(fast.masses) / np.mean(fast.masses))


def test_the_energy_never_rises():
    volume = volume_of(BODY)
    centers, energies = random_centers(volume), []
    for _ in range(25):
        energies.append(cells(centers, Ownership(volume.finest)).energy)
        centers = centroids(centers, Ownership(volume.finest))
    assert (np.diff(energies) <= 1e-15).all()
    assert energies[-1] < 0.8 * energies[0]


def test_a_center_that_owns_nothing_goes_to_the_nearest_sample():
    samples = VolumeSamples(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([1.0, 2.0, 3.0]), 1.0)
    centers = np.array([[0.0, 0, 0], [1.6, 0, 0], [9.0, 5.0, 0]])
    result = cells(centers, Ownership(samples))
    assert_allclose(result.centroids, [[0, 0, 0], [1.6, 0, 0], [2, 0, 0]])
    assert_allclose(result.masses, [1, 5, 0])
    assert_allclose(result.second[2], 0.0)


def test_spread_is_even_inside_and_settled():
    volume = volume_of(BODY)
    centers = spread(volume, CENTERS)
    spacing = volume.center_spacing(CENTERS)
    result = cells(centers, Ownership(volume.finest))
    assert result.non_uniformity < 0.15
    assert cells(random_centers(volume), Ownership(volume.finest)).non_uniformity > 0.3
    assert np.linalg.norm(result.centroids - centers, axis=1).max() < 0.05 * spacing
    ring = np.linalg.norm((centers @ TILT)[:, :2], axis=1)
    assert np.hypot(ring - 1.0, (centers @ TILT)[:, 2]).max() < 0.4, "inside the torus"
    assert result.energy / spacing**2 < 0.3, "a ball of volume s^3 has 0.231, a cube 0.25"


def test_each_body_gets_its_share_of_the_centers():
    volume = volume_of(joined(ball(2, 1.0), box((1.0, 1.0, 1.0), center=(3.0, 0, 0))), count=120)
    centers = spread(volume, 120)
    in_ball = np.linalg.norm(centers, axis=1) < 1.0
    in_box = (np.abs(centers - [3.0, 0, 0]) < 0.5).all(axis=1)
    assert (in_ball | in_box).all(), "none between them"
    share = np.average(volume.finest.positions[:, 0] < 1.5, weights=volume.finest.masses)
    assert in_ball.sum() == pytest.approx(120 * share, abs=1), "every cut but those through both bodies keeps the shares"


def test_the_same_volume_gives_the_same_centers():
    assert_array_equal(spread(volume_of(BODY), CENTERS), spread(volume_of(BODY), CENTERS))


def test_as_many_centers_as_voxels_and_more():
    volume = volume_of(box((1.0, 1.0, 1.0)), resolution=3, count=20)
    voxels = volume.finest.positions
    assert_allclose(np.sort(spread(volume, len(voxels)), axis=0), np.sort(voxels, axis=0))
    assert np.isfinite(spread(volume, len(voxels) + 13)).all()


@pytest.mark.parametrize(("scale", "shift"), [(0.5, 0.0), (1e-3, 0.0), (10.0, 0.0), (1.0, 20.0)])
def test_centers_scale_and_move_with_the_body(scale, shift):
    plain = spread(volume_of(BODY), CENTERS)
    changed = volume_of(moved(BODY, scale=scale, shift=(shift,) * 3))
    result = spread(changed, CENTERS)
    assert_allclose(result, scale * plain + shift, atol=1e-6 * changed.voxel)
