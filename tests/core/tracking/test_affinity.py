"""Affinity: symmetry, bounds, invariance, a twin that samples cells, and bodies that part."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import sparse

from refmesh_addon.core.geometry.rotations import RigidMotions, rigid_motions
from refmesh_addon.core.tracking import lloyd
from refmesh_addon.core.tracking.affinity import (
    DISAGREEMENT_HALF,
    FADE,
    MIN_AFFINITY,
    REACH,
    SEPARATION_HALF,
    Affinity,
    disagreement,
    group_affinity,
    near_pairs,
    updated,
)
from refmesh_addon.core.tracking.ownership import Ownership
from refmesh_addon.core.tracking.volume import VolumeSamples, sample_volume

from ..shapes import TILT, box, joined, moved

CENTERS = 60
BODY = moved(box(), TILT)


@pytest.fixture(scope="module")
def volume():
    return sample_volume(BODY, 32, CENTERS)


@pytest.fixture(scope="module")
def centers(volume):
    return lloyd.spread(volume, CENTERS)


def bent(points, share):
    """Rolled about the y axis, more the farther along x."""
    angle = share * points[:, 0]
    x, y, z = points.T
    return np.stack([np.cos(angle) * x + np.sin(angle) * z, y, -np.sin(angle) * x + np.cos(angle) * z], axis=1)


def after_one_frame(centers, volume, target, variant="max"):
    before = near_pairs(centers, volume.center_spacing(CENTERS))
    motions = rigid_motions(before.weights(), centers, target)
    return updated(before, target, lloyd.cells(centers, Ownership(volume.finest)), motions, variant)


def test_all_pairs_within_reach_are_found_once(centers, volume):
    spacing = volume.center_spacing(CENTERS)
    affinity = near_pairs(centers, spacing)
    distance = np.linalg.norm(centers[:, None] - centers[None], axis=2)
    expected = [(i, j) for i in range(CENTERS) for j in range(i + 1, CENTERS) if distance[i, j] <= REACH * spacing]
    assert list(zip(affinity.first.tolist(), affinity.second.tolist())) == expected
    assert_allclose(affinity.separation, distance[affinity.first, affinity.second] ** 2 / spacing**2)


def test_the_constants_are_where_an_affinity_halves_and_ends():
    pairs = Affinity(np.array([0, 1]), np.array([1, 2]), np.array([SEPARATION_HALF**2, REACH**2]), np.ones(2), 3, 1.0)
    assert_allclose(pairs.values(), [0.5, MIN_AFFINITY])


@pytest.mark.parametrize("variant", ["max", "iir"])
def test_weights_are_symmetric_from_zero_to_one_with_ones_on_the_diagonal(centers, volume, variant):
    affinity = after_one_frame(centers, volume, bent(centers, 0.8), variant)
    assert (affinity.agreement > 0).all() and (affinity.agreement <= 1).all()
    weights = affinity.weights().toarray()
    assert_array_equal(weights, weights.T)
    assert_array_equal(np.diag(weights), 1.0)
    assert weights.max() == 1.0
    assert weights[weights > 0].min() >= MIN_AFFINITY
    assert (affinity.values() < MIN_AFFINITY).any(), "some are dropped"


def test_disagreement_is_the_mean_over_the_voxels_of_both_cells(centers, volume):
    target = bent(centers, 1.0) + 0.02 * np.random.default_rng(0).normal(size=centers.shape)
    spacing = volume.center_spacing(CENTERS)
    affinity = near_pairs(centers, spacing)
    motions = rigid_motions(affinity.weights(), centers, target)
    samples = volume.finest
    owner = np.array([np.argmin(np.linalg.norm(centers - q, axis=1)) for q in samples.positions])

    def mean_over(cell, i, j):
        q, mass = samples.positions[owner == cell], samples.masses[owner == cell]
        apart = (moved_by(motions, i, q) - moved_by(motions, j, q)) ** 2
        return mass @ apart.sum(axis=1) / mass.sum()

    slow = [(mean_over(i, i, j) + mean_over(j, i, j)) / (2 * spacing**2) for i, j in zip(affinity.first, affinity.second)]
    assert_allclose(disagreement(affinity, lloyd.cells(centers, Ownership(samples)), motions), slow, rtol=1e-9, atol=1e-15)


def moved_by(motions: RigidMotions, index, points):
    return (points - motions.sources[index]) @ motions.rotations[index].T + motions.targets[index]


def test_a_rigid_motion_changes_nothing(centers, volume):
    before = near_pairs(centers, volume.center_spacing(CENTERS))
    after = after_one_frame(centers, volume, centers @ TILT.T + [5.0, -3.0, 1.0])
    assert_allclose(after.agreement, 1.0, atol=1e-9)
    assert_allclose(after.separation, before.separation, rtol=1e-9)


@pytest.mark.parametrize("change", [{"scale": 1e-3}, {"scale": 10.0}, {"turn": TILT}, {"shift": (40.0, 2.0, -9.0)}])
def test_moving_and_scaling_all_frames_alike_changes_nothing(centers, volume, change):
    turn, shift, scale = change.get("turn", np.eye(3)), np.array(change.get("shift", (0, 0, 0))), change.get("scale", 1.0)
    samples = volume.finest
    samples = VolumeSamples(scale * samples.positions @ turn.T + shift, samples.masses, scale * samples.spacing)
    target = bent(centers, 0.7)

    def affinity(positions, goal, cells_of, spacing):
        pairs = near_pairs(positions, spacing)
        return updated(pairs, goal, lloyd.cells(positions, Ownership(cells_of)), rigid_motions(pairs.weights(), positions, goal))

    spacing = volume.center_spacing(CENTERS)
    plain = affinity(centers, target, volume.finest, spacing)
    changed = affinity(*(scale * points @ turn.T + shift for points in (centers, target)), samples, scale * spacing)
    assert_allclose(changed.values(), plain.values(), rtol=1e-6)


def test_the_maximum_never_forgets_and_the_falloff_does(centers, volume):
    samples, spacing = volume.finest, volume.center_spacing(CENTERS)
    cells = lloyd.cells(centers, Ownership(samples))
    for variant in ("max", "iir"):
        bend = after_one_frame(centers, volume, bent(centers, 1.5), variant)
        still = rigid_motions(near_pairs(centers, spacing).weights(), centers, centers)
        history = [bend]
        for _ in range(60):
            history.append(updated(history[-1], centers, cells, still, variant))
        agreement = np.stack([step.agreement for step in history])
        if variant == "max":
            assert_array_equal(agreement[-1], agreement[0])
        else:
            assert_allclose(1 - agreement[-1], (1 - FADE) ** 60 * (1 - agreement[0]), rtol=1e-6, atol=1e-9)
        assert (np.diff([step.separation for step in history], axis=0) >= 0).all()


def test_half_agreement_at_the_stated_disagreement():
    pair = Affinity(np.array([0]), np.array([1]), np.zeros(1), np.ones(1), 2, 2.0)
    points = np.zeros((2, 3))
    cells = lloyd.Cells(np.ones(2), points, np.zeros((2, 3, 3)), 0.0)
    apart = RigidMotions(np.broadcast_to(np.eye(3), (2, 3, 3)), points, np.array([[0.0, 0, 0], [DISAGREEMENT_HALF * 2.0, 0, 0]]))
    assert updated(pair, points, cells, apart).agreement[0] == pytest.approx(0.5)


@pytest.fixture(scope="module")
def parting():
    """Two stacked boxes of which the upper one slides off: (3, C, 3) centers, the body of each, and s."""
    volume = sample_volume(joined(box((1, 1, 1)), box((1, 1, 1), center=(0, 0, 1.001))), 40, CENTERS)
    centers = lloyd.spread(volume, CENTERS)
    upper, spacing = centers[:, 2] > 0.5, volume.center_spacing(CENTERS)
    slide = np.where(upper[:, None], [1.0, 0.0, 0.0], 0.0)
    return np.stack([centers, centers + 2.5 * spacing * slide, centers + 5 * spacing * slide]), upper, spacing


@pytest.mark.parametrize("anchor", [0, 2])
def test_bodies_that_part_have_no_affinity_in_their_group(parting, anchor):
    positions, upper, spacing = parting
    tracked = near_pairs(positions[0], spacing).weights()
    tracked = tracked.multiply(upper[:, None] == upper[None, :]).tocsr()  # what tracking knows once they have parted
    weights = group_affinity(positions, anchor, tracked, spacing).weights().toarray()
    assert (weights[upper][:, ~upper] < 0.02).all()
    assert np.median((weights[upper][:, upper] > 0.1).sum(axis=1)) > 8, "each body still hangs together"


def test_a_group_that_moves_as_one_hangs_together_as_in_one_frame(parting):
    positions, _, spacing = parting
    tracked = near_pairs(positions[0], spacing).weights()
    moved_alike = np.stack([positions[0], positions[0] @ TILT.T + 3.0])
    group = group_affinity(moved_alike, 0, sparse.csr_matrix(tracked), spacing)
    assert_allclose(group.values(), near_pairs(positions[0], spacing).values(), rtol=1e-6)


def test_an_unknown_variant_is_refused_with_the_known_ones(centers, volume):
    with pytest.raises(ValueError, match="variant must be one of 'max', 'iir'; got 'irr'"):
        after_one_frame(centers, volume, centers, "irr")
