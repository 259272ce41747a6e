"""SMACOF against a plain loop, and configurations that it must find."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from refmesh_addon.core.errors import Cancelled
from refmesh_addon.core.reference import reference_centers as module
from refmesh_addon.core.reference.reference_centers import (
    largest_distances,
    near_weights,
    reference_centers,
    rigidly_aligned,
    smacof,
    stress,
)

from ..shapes import QUARTER_TURN, TILT


def random_points(count=40, seed=0):
    return np.random.default_rng(seed).random((count, 3)) * [2.0, 1.0, 0.7]


def random_frames(frames=4, count=40, noise=0.1):
    rng = np.random.default_rng(1)
    return random_points(count) + noise * rng.normal(size=(frames, count, 3))


def parting_frames():
    """Two blocks that touch in the first frame and slide off in the third."""
    lower, upper = random_points(30), random_points(30, seed=2) + [0, 0, 0.75]
    return np.stack([np.vstack([lower, upper + [slide, 0, 0]]) for slide in (0.0, 1.0, 2.5)])


def distances(points):
    return np.linalg.norm(points[:, None] - points[None], axis=2)


def test_largest_distances_and_stress_same_as_loops():
    frames = random_frames()
    wanted = np.array([[max(np.linalg.norm(frame[i] - frame[j]) for frame in frames) for j in range(40)] for i in range(40)])
    assert_allclose(largest_distances(frames), wanted, atol=1e-14)
    missed = sum((wanted[i, j] - np.linalg.norm(frames[0][i] - frames[0][j])) ** 2 for i in range(40) for j in range(40))
    assert stress(frames[0], wanted) == pytest.approx(np.sqrt(missed / (wanted**2).sum()), rel=1e-12)


def guttman_by_loop(points, wanted):
    """One step of De Leeuw 1977, pair by pair."""
    moved = np.zeros_like(points)
    for i in range(len(points)):
        for j in range(len(points)):
            if i != j:
                apart = points[i] - points[j]
                moved[i] += wanted[i, j] * apart / np.linalg.norm(apart)
    return moved / len(points)


def test_steps_same_as_a_loop(monkeypatch):
    wanted, points = largest_distances(random_frames()), random_points(seed=5)
    monkeypatch.setattr(module, "MAX_STEPS", 3)
    expected = points - points.mean(axis=0)
    for _ in range(3):
        expected = guttman_by_loop(expected, wanted)
    assert_allclose(smacof(wanted, points), expected, atol=1e-12)


def test_stress_never_rises(monkeypatch):
    wanted, history = largest_distances(parting_frames()), []
    for steps in range(1, 60):
        monkeypatch.setattr(module, "MAX_STEPS", steps)
        history.append(stress(smacof(wanted, parting_frames()[0]), wanted))
    assert (np.diff(history) <= 1e-12).all()
    assert history[-1] < 0.5 * history[0]


def test_an_exact_configuration_is_found_again_up_to_a_rigid_motion():
    points = random_points()
    disturbed = points + 0.05 * np.random.default_rng(3).normal(size=points.shape)
    found = smacof(distances(points), disturbed)
    assert stress(found, distances(points)) < 2e-3
    assert stress(disturbed, distances(points)) > 0.05
    assert_allclose(rigidly_aligned(found, points), points, atol=0.02)


def test_one_frame_is_its_own_reference():
    points = random_points()
    found = reference_centers(points[None])
    assert_allclose(found.positions, points, atol=1e-12)
    assert (found.anchor, found.stress) == (0, pytest.approx(0.0, abs=1e-12))


def test_frames_that_differ_by_rigid_motions_give_one_of_them():
    points = random_points()
    frames = np.stack([points @ Rotation.random(random_state=k).as_matrix().T + k for k in range(4)])
    found = reference_centers(frames)
    assert_allclose(found.positions, frames[found.anchor], atol=1e-9)
    assert_allclose(found.frame_stress, 0.0, atol=1e-9)


def test_the_anchor_is_the_frame_that_fits_best():
    frames = random_frames()
    found = reference_centers(frames)
    wanted = largest_distances(frames)
    assert_allclose(found.frame_stress, [stress(frame, wanted) for frame in frames])
    assert found.anchor == np.argmin(found.frame_stress)
    assert found.stress == pytest.approx(stress(found.positions, wanted))
    assert found.stress <= found.frame_stress.min()
    assert_allclose(rigidly_aligned(found.positions, frames[found.anchor]), found.positions, atol=1e-12)


def test_what_parts_in_any_frame_is_apart():
    frames = parting_frames()
    found = reference_centers(frames)
    assert found.anchor == 2
    lower, upper = found.positions[:30], found.positions[30:]
    apart = np.linalg.norm(lower[:, None] - upper[None], axis=2)
    assert apart.min() > 0.9 * np.linalg.norm(frames[2][:30, None] - frames[2][None, 30:], axis=2).min()
    for block, rest in ((lower, frames[0][:30]), (upper, frames[0][30:])):
        assert stress(block, distances(rest)) < 0.1


def test_frames_moved_each_in_its_own_way_change_only_where_the_result_lies():
    frames = random_frames()
    changed = np.stack([frame @ Rotation.random(random_state=k).as_matrix().T + 10 * k for k, frame in enumerate(frames)])
    plain, found = reference_centers(frames), reference_centers(changed)
    assert found.anchor == plain.anchor
    assert found.stress == pytest.approx(plain.stress, rel=1e-6)
    turn = Rotation.random(random_state=plain.anchor).as_matrix()
    assert_allclose(found.positions, plain.positions @ turn.T + 10 * plain.anchor, atol=1e-6)


@pytest.mark.parametrize("scale", [1e-3, 10.0, 1e4])
def test_scaling_scales(scale):
    plain, found = reference_centers(random_frames()), reference_centers(scale * random_frames())
    assert_allclose(found.positions, scale * plain.positions, rtol=1e-6, atol=1e-9 * scale)
    assert found.stress == pytest.approx(plain.stress, rel=1e-6)


def test_centers_on_one_spot_do_not_divide_by_zero():
    frames = random_frames()
    frames[:, 1] = frames[:, 0]
    assert np.isfinite(reference_centers(frames).positions).all()
    assert stress(np.zeros((3, 3)), np.zeros((3, 3))) == 0.0


def test_alignment_undoes_a_rigid_motion_and_never_mirrors():
    points = random_points()
    assert_allclose(rigidly_aligned(points @ TILT.T @ QUARTER_TURN.T + [3, 4, 5], points), points, atol=1e-12)
    mirrored = points * [-1.0, 1.0, 1.0]
    aligned = rigidly_aligned(mirrored, points)
    assert_allclose(distances(aligned), distances(points), atol=1e-12)
    sides = [np.linalg.det(cloud[1:4] - cloud[0]) for cloud in (aligned, mirrored)]
    assert sides[0] == pytest.approx(sides[1])


def test_progress_ends_at_one_and_can_stop_the_work():
    shares = []
    reference_centers(random_frames(), shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0

    def stop(share):
        raise Cancelled

    with pytest.raises(Cancelled):
        reference_centers(random_frames(), stop)


@pytest.mark.parametrize("shape", [(3, 3), (2, 5, 2), (0, 5, 3)])
def test_other_shapes_are_refused(shape):
    with pytest.raises(ValueError, match=r"positions must be \(F, C, 3\)"):
        reference_centers(np.zeros(shape))


def test_an_unknown_way_of_counting_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match="counted must be one of 'plain', 'near'; got 'far'"):
        reference_centers(random_frames(), counted="far")


def test_the_input_is_left_alone():
    frames = random_frames()
    before = frames.copy()
    reference_centers(frames)
    assert_array_equal(frames, before)


def weighted(points, wanted, weights):
    missed = wanted - distances(points)
    return np.sqrt((weights * missed**2).sum())


def test_near_pairs_are_kept_better_when_they_count_more():
    frames = parting_frames()
    wanted = largest_distances(frames)
    plain, near = (reference_centers(frames, counted=counted).positions for counted in ("plain", "near"))
    assert weighted(near, wanted, near_weights(wanted)) < weighted(plain, wanted, near_weights(wanted))
    assert stress(near, wanted) >= stress(plain, wanted)


def test_weighted_steps_same_as_with_the_pseudo_inverse(monkeypatch):
    wanted, points = largest_distances(random_frames()), random_points(seed=5)
    monkeypatch.setattr(module, "MAX_STEPS", 3)
    weights = near_weights(wanted)
    inverse = np.linalg.pinv(np.diag(weights.sum(axis=1)) - weights)
    expected = points - points.mean(axis=0)
    for _ in range(3):
        ratio = np.divide(weights * wanted, distances(expected), out=np.zeros_like(wanted), where=weights > 0)
        expected = inverse @ ((np.diag(ratio.sum(axis=1)) - ratio) @ expected)
    assert_allclose(smacof(wanted, points, weights=weights), expected, atol=1e-10)
    alike = 1.0 - np.eye(len(points))
    assert_allclose(smacof(wanted, points, weights=alike), smacof(wanted, points), atol=1e-10)


def test_weights_do_not_depend_on_scale_or_coincidence():
    wanted = distances(random_frames()[0])
    assert_allclose(near_weights(1e3 * wanted), near_weights(wanted), rtol=1e-12)
    assert near_weights(wanted).mean() == pytest.approx(1.0)
    assert np.isfinite(near_weights(np.zeros((4, 4)))).all()
