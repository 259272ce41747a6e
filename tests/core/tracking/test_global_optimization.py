"""Positions of all frames optimized together, on bodies small enough to know what is right."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import sparse

from refmesh_addon.core.tracking import lloyd
from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.tracking.global_optimization import Trajectories, optimize, sequence_affinity
from refmesh_addon.core.tracking.volume import VolumeSamples, sample_volume

from ..shapes import QUARTER_TURN, TILT, ball
from .rigid_sequence import COUNT, EVEN, FRAMES, MOTION, SPACING, carried, moved_samples, samples_of, settled, shaken, weights_of


def optimized(positions, variant="max"):
    return optimize(Trajectories(positions, weights_of(positions), SPACING), samples_of, variant)


@pytest.fixture(scope="module")
def plain():
    return optimized(shaken())


@pytest.mark.parametrize("seed", [1, 2])
def test_the_energy_never_rises_and_falls_where_it_can(seed):
    energies = optimized(shaken(seed), "iir").energies
    assert (np.diff(energies) < 0).all()
    assert energies[-1] < 0.9 * energies[0]


def test_an_even_spread_that_moves_rigidly_stays():
    positions = carried(settled())
    result = optimized(positions)
    assert_allclose(result.positions, positions, atol=1e-3 * SPACING)
    assert_array_equal(result.kept, np.arange(COUNT))
    assert result.arap_energy.max() < 1e-9


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
    result = optimize(
        Trajectories(scale * positions @ turn.T + shift, weights_of(positions), scale * SPACING),
        lambda frame: moved_samples(samples_of(frame), turn, shift, scale),
    )
    assert_allclose(result.positions, scale * plain.positions @ turn.T + shift, atol=1e-4 * scale * SPACING)
    assert_allclose(result.energies, plain.energies, rtol=1e-5)
    assert_allclose(result.affinity.values(), plain.affinity.values(), atol=1e-4)


def test_a_stray_trajectory_is_dropped_and_no_other():
    positions = carried(EVEN)
    positions[FRAMES // 2 :, 17] += 4 * SPACING
    result = optimized(positions)
    assert_array_equal(result.kept, np.delete(np.arange(COUNT), 17))
    assert result.positions.shape == (FRAMES, COUNT - 1, 3)
    assert result.affinity.centers == COUNT - 1


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
    tracks = Trajectories(positions, start, spacing)
    tracks = replace(tracks, weights=sequence_affinity(tracks, samples.__getitem__, "max").weights())
    weights = sequence_affinity(tracks, samples.__getitem__, "max").weights().toarray()
    assert weights[left][:, ~left].max() < 0.5 * np.median(weights[left][:, left].max(axis=1))


def test_one_frame_is_only_spread():
    result = optimized(shaken()[:1])
    assert (np.diff(result.energies) < 0).all()
    assert_array_equal(result.arap_energy, [0.0])


def test_the_same_input_gives_the_same_bytes_and_progress_grows_to_one(plain):
    shares = []
    again = optimize(Trajectories(shaken(), weights_of(shaken()), SPACING), samples_of, progress=shares.append)
    assert_array_equal(again.positions, plain.positions)
    assert_array_equal(again.affinity.values(), plain.affinity.values())
    assert shares == sorted(shares) and shares[-1] == 1.0


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
    given = {"positions": shaken(), "weights": sparse.eye(COUNT), "spacing": SPACING, "variant": "max"} | change
    variant = given.pop("variant")
    with pytest.raises(ValueError, match=message):
        optimize(Trajectories(**given), samples_of, variant)


def test_bodies_that_are_known_have_no_affinity():
    bodies = np.arange(COUNT) % 2
    result = optimize(Trajectories(shaken(), weights_of(shaken()), SPACING, bodies), samples_of)
    first, second = result.affinity.first, result.affinity.second
    assert (bodies[result.kept][first] == bodies[result.kept][second]).all() and len(first)
