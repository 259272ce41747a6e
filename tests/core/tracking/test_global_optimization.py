"""Positions of all frames optimised together, on bodies small enough to know what is right."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import sparse
from scipy.spatial.transform import Rotation

from refmesh_addon.core.geometry.rotations import rigid_motions
from refmesh_addon.core.tracking import lloyd
from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.tracking.global_optimization import (
    DROPPED_SHARE,
    RIGIDITY,
    SAMPLES_PER_CENTER,
    Misfit,
    coarse_samples,
    irregularity,
    minimised,
    optimize,
    regular,
    sequence_affinity,
)
from refmesh_addon.core.tracking.ownership import Ownership
from refmesh_addon.core.tracking.volume import VolumeSamples, sample_volume

from ..shapes import QUARTER_TURN, TILT, ball, box, joined

COUNT, FRAMES = 30, 3
BODY = joined(box(), box((0.5, 0.5, 0.9), center=(0.9, 0.2, 0.7)))
VOLUME = sample_volume(BODY, 24, COUNT)
SPACING = VOLUME.center_spacing(COUNT)
SAMPLES = coarse_samples(VOLUME, COUNT)
EVEN = lloyd.spread(VOLUME, COUNT)
TURNS = [Rotation.from_rotvec([0.1 * step, 0.0, 0.05 * step]).as_matrix() for step in range(FRAMES)]
SHIFTS = [SPACING * step * np.array([0.5, 0.3, -0.2]) for step in range(FRAMES)]
MOTION = list(zip(TURNS, SHIFTS, strict=True))


def moved_samples(samples, turn, shift, scale=1.0):
    return VolumeSamples(scale * samples.positions @ turn.T + shift, samples.masses, scale * samples.spacing)


def samples_of(frame):
    return moved_samples(SAMPLES, *MOTION[frame])


def carried(centers):
    return np.stack([centers @ turn.T + shift for turn, shift in MOTION])


def settled(steps=300):
    """Centers that Lloyd's relaxation on these very samples leaves where they are."""
    centers = EVEN
    for _ in range(steps):
        centers = lloyd.centroids(centers, Ownership(SAMPLES))
    return centers


def shaken(seed=0, size=0.2):
    return carried(EVEN) + size * SPACING * np.random.default_rng(seed).normal(size=(FRAMES, COUNT, 3))


def weights_of(positions):
    return near_pairs(positions[0], SPACING).weights()


def optimized(positions, variant="max"):
    return optimize(positions, weights_of(positions), samples_of, SPACING, variant)


@pytest.fixture(scope="module")
def plain():
    return optimized(shaken())


@pytest.mark.parametrize("seed", [1, 2])
def test_the_energy_never_rises_and_falls_where_it_can(seed):
    energies = optimized(shaken(seed), "iir").energies
    assert (np.diff(energies) < 0).all()
    assert energies[-1] < 0.9 * energies[0]


def test_the_energy_is_that_of_the_positions_returned():
    found, energies = minimised(shaken(), weights_of(shaken()), samples_of, SPACING)
    misfit = Misfit(weights_of(shaken()))
    arap = [misfit(*found.positions[[frame - 1, frame]])[0] / SPACING**2 for frame in range(1, FRAMES)]
    spread = [lloyd.cells(centers, Ownership(samples_of(frame))).energy / SPACING**2 for frame, centers in enumerate(found.positions)]
    assert_allclose(found.arap_energy, [0, *arap])
    assert_allclose(found.lloyd_energy, spread)
    assert energies[-1] == pytest.approx(sum(spread) + RIGIDITY * sum(arap))


def test_an_even_spread_that_moves_rigidly_stays():
    positions = carried(settled())
    found = optimized(positions)
    assert_allclose(found.positions, positions, atol=1e-3 * SPACING)
    assert_array_equal(found.kept, np.arange(COUNT))
    assert found.arap_energy.max() < 1e-9


def test_noise_on_a_rigid_motion_goes(plain):
    back = np.stack([(centers - shift) @ turn for centers, (turn, shift) in zip(plain.positions, MOTION, strict=True)])
    wander = np.linalg.norm(back - back.mean(axis=0), axis=2)
    assert np.median(wander) < 0.05 * SPACING
    assert plain.arap_energy.sum() < 0.01


@pytest.mark.parametrize(
    ("scale", "turn", "shift"),
    [(1e-3, np.eye(3), 0.0), (10.0, np.eye(3), 0.0), (1.0, QUARTER_TURN, 0.0), (1.0, TILT, 0.0), (1.0, np.eye(3), 30.0)],
    ids=["small", "large", "turned", "tilted", "far"],
)
def test_scaling_turning_and_moving_the_input_does_the_same_to_the_result(plain, scale, turn, shift):
    positions = shaken()
    found = optimize(
        scale * positions @ turn.T + shift,
        weights_of(positions),
        lambda frame: moved_samples(samples_of(frame), turn, shift, scale),
        scale * SPACING,
    )
    assert_allclose(found.positions, scale * plain.positions @ turn.T + shift, atol=1e-4 * scale * SPACING)
    assert_allclose(found.energies, plain.energies, rtol=1e-5)
    assert_allclose(found.affinity.values(), plain.affinity.values(), atol=1e-4)


def plain_misfit(weights, before, after):
    motions = rigid_motions(weights, before, after)
    total = 0.0
    for i, row in enumerate(weights.toarray()):
        images = (before - motions.sources[i]) @ motions.rotations[i].T + motions.targets[i]
        total += row @ ((images - after) ** 2).sum(axis=1) / row.sum()
    return total / len(before)


@pytest.fixture
def pair():
    rng = np.random.default_rng(1)
    before = rng.normal(size=(9, 3))
    linked = rng.random((9, 9))
    weights = sparse.csr_matrix(np.maximum(linked, linked.T) * (linked + linked.T > 0.8) + np.eye(9))
    return weights, before, before @ TILT.T + 5.0 + 0.2 * rng.normal(size=(9, 3))


def test_misfit_is_the_mean_distance_missed_and_equal_both_ways(pair):
    weights, before, after = pair
    assert Misfit(weights)(before, after)[0] == pytest.approx(plain_misfit(weights, before, after))
    assert Misfit(weights)(after, before)[0] == pytest.approx(plain_misfit(weights, before, after))


def test_misfit_gradients_are_the_finite_differences(pair):
    weights, *pair = pair
    misfit, step = Misfit(weights), 1e-5
    _, *gradients = misfit(*pair)
    for which, gradient in enumerate(gradients):
        slopes = np.empty(gradient.shape)
        for place in np.ndindex(slopes.shape):
            ends = []
            for side in (step, -step):
                changed = [points.copy() for points in pair]
                changed[which][place] += side
                ends.append(misfit(*changed)[0])
            slopes[place] = (ends[0] - ends[1]) / (2 * step)
        assert_allclose(2 / len(gradient) * gradient, slopes, atol=1e-8)


def test_irregularity_against_its_plain_twin():
    positions = shaken() + 1e3
    distance = ((positions[:, :, None] - positions[:, None]) ** 2).sum(axis=3).mean(axis=0)
    np.fill_diagonal(distance, np.inf)
    assert_allclose(irregularity(positions), distance.min(axis=1), rtol=1e-6)
    assert_array_equal(irregularity(positions[:, :1]), [0.0])


def test_a_stray_trajectory_is_dropped_and_no_other():
    positions = carried(EVEN)
    positions[FRAMES // 2 :, 17] += 4 * SPACING
    found = optimized(positions)
    assert_array_equal(found.kept, np.delete(np.arange(COUNT), 17))
    assert found.positions.shape == (FRAMES, COUNT - 1, 3)
    assert found.affinity.centers == COUNT - 1


def test_no_more_than_a_few_are_dropped_at_a_time():
    positions = np.random.default_rng(0).uniform(size=(3, 1000, 3))
    positions[:, ::50] += 100 * np.arange(20)[:, None]
    assert len(regular(positions)) == 1000 - np.ceil(1000 * DROPPED_SHARE)


def test_bodies_that_part_late_have_no_affinity_in_any_frame():
    """Two balls that touch at first: only the whole sequence tells them apart."""
    halves = [sample_volume(ball(2, center=(side, 0, 0)), 24, 20) for side in (-1, 1)]
    centers = np.vstack([lloyd.spread(half, 20) for half in halves])
    left = centers[:, 0] < 0
    spacing = halves[0].center_spacing(20)
    shifts = [np.where(left, -1, 1)[:, None] * [0.5 * spacing * max(step - 1, 0), 0, 0] for step in range(4)]
    positions = np.stack([centers + shift for shift in shifts])
    samples = [VolumeSamples(positions[step], np.ones(40), spacing) for step in range(4)]
    start = near_pairs(centers, spacing).weights()
    weights = sequence_affinity(positions, start, lambda frame: samples[frame], spacing, "max").weights().toarray()
    weights = sequence_affinity(positions, sparse.csr_matrix(weights), lambda frame: samples[frame], spacing, "max").weights().toarray()
    assert weights[left][:, ~left].max() < 0.5 * np.median(weights[left][:, left].max(axis=1))


def test_one_frame_is_only_spread():
    found = optimized(shaken()[:1])
    assert (np.diff(found.energies) < 0).all()
    assert_array_equal(found.arap_energy, [0.0])


def test_a_center_without_volume_or_kin_stays_defined():
    positions = np.concatenate([carried(EVEN), np.full((FRAMES, 1, 3), 3.0 * SPACING)], axis=1)
    found, _ = minimised(positions, sparse.block_diag([weights_of(carried(EVEN)), [[1.0]]]).tocsr(), samples_of, SPACING)
    assert np.isfinite(found.positions).all()


def test_the_same_input_gives_the_same_bytes_and_progress_grows_to_one(plain):
    shares = []
    again = optimize(shaken(), weights_of(shaken()), samples_of, SPACING, progress=shares.append)
    assert_array_equal(again.positions, plain.positions)
    assert_array_equal(again.affinity.values(), plain.affinity.values())
    assert shares == sorted(shares) and shares[-1] == 1.0


def test_coarse_samples_keep_the_mass_and_its_place_and_are_few():
    volume = sample_volume(BODY, 96, COUNT)
    samples, finest = coarse_samples(volume, COUNT), volume.finest
    assert samples.masses.sum() == finest.masses.sum()
    assert_allclose(samples.masses @ samples.positions, finest.masses @ finest.positions)
    assert 0.8 * SAMPLES_PER_CENTER * COUNT < len(samples.masses) < 2 * SAMPLES_PER_CENTER * COUNT < len(finest.masses)
    assert coarse_samples(volume, 10**6) is finest


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"positions": np.zeros((2, 3))}, "positions must be"),
        ({"positions": np.zeros((0, 5, 3))}, "positions must be"),
        ({"positions": np.full((2, COUNT, 3), np.nan)}, "finite"),
        ({"weights": sparse.eye(COUNT + 1)}, "weights must be"),
        ({"spacing": 0.0}, "spacing must be"),
        ({"variant": "irr"}, "variant must be one of 'max', 'iir'; got 'irr'"),
    ],
)
def test_input_that_does_not_fit_is_refused(change, message):
    given = {"positions": shaken(), "weights": sparse.eye(COUNT), "samples_of": samples_of, "spacing": SPACING}
    with pytest.raises(ValueError, match=message):
        optimize(**{**given, **change})
