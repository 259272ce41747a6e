"""Reference centers: the anchor, what parts, and what motions and scales do to them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from refmesh_addon.core.errors import Canceled
from refmesh_addon.core.reference.reference_centers import largest_distances, reference_centers, rigidly_aligned
from refmesh_addon.core.reference.smacof import near_weights, stress

from ..shapes import QUARTER_TURN, TILT
from .parting_frames import distances, parting_frames, random_frames, random_points


def test_largest_distances_and_stress_same_as_loops():
    frames = random_frames()
    largest = np.array([[max(np.linalg.norm(frame[i] - frame[j]) for frame in frames) for j in range(40)] for i in range(40)])
    assert_allclose(largest_distances(frames), largest, atol=1e-14)
    missed = sum((largest[i, j] - np.linalg.norm(frames[0][i] - frames[0][j])) ** 2 for i in range(40) for j in range(40))
    assert stress(frames[0], largest) == pytest.approx(np.sqrt(missed / (largest**2).sum()), rel=1e-12)


def test_one_frame_is_its_own_reference():
    points = random_points()
    result = reference_centers(points[None])
    assert_allclose(result.positions, points, atol=1e-12)
    assert (result.anchor, result.stress) == (0, pytest.approx(0.0, abs=1e-12))


def test_frames_that_differ_by_rigid_motions_give_one_of_them():
    points = random_points()
    frames = np.stack([points @ Rotation.random(random_state=k).as_matrix().T + k for k in range(4)])
    result = reference_centers(frames)
    assert_allclose(result.positions, frames[result.anchor], atol=1e-9)
    assert_allclose(result.frame_stress, 0.0, atol=1e-9)


def test_the_anchor_is_the_frame_that_fits_best():
    frames = random_frames()
    result = reference_centers(frames)
    largest = largest_distances(frames)
    assert_allclose(result.frame_stress, [stress(frame, largest) for frame in frames])
    assert result.anchor == np.argmin(result.frame_stress)
    assert result.stress == pytest.approx(stress(result.positions, largest))
    assert result.stress <= result.frame_stress.min()
    assert_allclose(rigidly_aligned(result.positions, frames[result.anchor]), result.positions, atol=1e-12)


def test_the_anchor_has_clean_rims_among_frames_that_fit_nearly_as_well():
    frames = random_frames()
    order = np.argsort(reference_centers(frames).frame_stress)
    ragged = np.ones(len(frames))
    ragged[order[1]] = 0.5
    assert reference_centers(frames, penalty=ragged).anchor == order[1]
    assert reference_centers(frames, penalty=np.zeros(len(frames))).anchor == order[0]
    best = frames[order[0]]
    shrunk = np.stack([best, 1.001 * best, 0.5 * best])  # the last has by far the highest stress
    assert reference_centers(shrunk, penalty=np.array([1.0, 1.0, 0.0])).anchor == 1


def test_what_parts_in_any_frame_is_apart():
    frames = parting_frames()
    result = reference_centers(frames)
    assert result.anchor == 2
    lower, upper = result.positions[:30], result.positions[30:]
    apart = np.linalg.norm(lower[:, None] - upper[None], axis=2)
    assert apart.min() > 0.9 * np.linalg.norm(frames[2][:30, None] - frames[2][None, 30:], axis=2).min()
    for block, rest in ((lower, frames[0][:30]), (upper, frames[0][30:])):
        assert stress(block, distances(rest)) < 0.1


def test_frames_moved_each_in_its_own_way_change_only_where_the_result_lies():
    frames = random_frames()
    changed = np.stack([frame @ Rotation.random(random_state=k).as_matrix().T + 10 * k for k, frame in enumerate(frames)])
    plain, result = reference_centers(frames), reference_centers(changed)
    assert result.anchor == plain.anchor
    assert result.stress == pytest.approx(plain.stress, rel=1e-6)
    turn = Rotation.random(random_state=plain.anchor).as_matrix()
    assert_allclose(result.positions, plain.positions @ turn.T + 10 * plain.anchor, atol=1e-6)


@pytest.mark.parametrize("scale", [1e-3, 10.0, 1e4])
def test_scaling_scales(scale):
    plain, result = reference_centers(random_frames()), reference_centers(scale * random_frames())
    assert_allclose(result.positions, scale * plain.positions, rtol=1e-6, atol=1e-9 * scale)
    assert result.stress == pytest.approx(plain.stress, rel=1e-6)


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
        raise Canceled

    with pytest.raises(Canceled):
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


def weighted(points, largest, weights):
    missed = largest - distances(points)
    return np.sqrt((weights * missed**2).sum())


def test_near_pairs_are_kept_better_when_they_count_more():
    frames = parting_frames()
    largest = largest_distances(frames)
    plain, near = (reference_centers(frames, counted=counted).positions for counted in ("plain", "near"))
    assert weighted(near, largest, near_weights(largest)) < weighted(plain, largest, near_weights(largest))
    assert stress(near, largest) >= stress(plain, largest)


def test_bodies_that_turn_against_each_other_keep_their_shapes_where_they_are_told_apart():
    gear = random_points()
    turns = [Rotation.from_rotvec([0, 0, angle]).as_matrix() for angle in np.linspace(0, np.pi, 7)]
    frames = np.stack([np.concatenate([gear @ turn.T, gear @ turn + [3, 0, 0]]) for turn in turns])
    bodies = np.repeat([0, 1], len(gear))
    joined, apart = reference_centers(frames), reference_centers(frames, bodies=bodies)
    assert apart.stress == pytest.approx(0.0, abs=1e-9) and joined.stress > 0.01
    assert_allclose(apart.positions, frames[apart.anchor], atol=1e-8)
    one = reference_centers(frames, bodies=np.zeros(len(bodies), dtype=int))
    assert_array_equal(one.positions, joined.positions)
