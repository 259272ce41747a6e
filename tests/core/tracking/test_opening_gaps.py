"""A lid that lies fused on a block and swings open: its centers go with it, although volume did not tell the two apart."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.spatial.transform import Rotation

from refmesh_addon.core.settings import TrackingSettings
from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.tracking.forward import first_frame, next_frame
from refmesh_addon.core.tracking.opening_gaps import LINE, in_gaps, tracked_on, without_gaps
from refmesh_addon.core.tracking.volume import sample_volume
from tests.core.shapes import box, joined

SETTINGS = TrackingSettings(centers=150, resolution=64)
HINGE = np.array([-1.0, 0.5, 0.0])
ANGLES = (0.0, 0.0, 0.2, 0.4)  # radians; the free end moves by about one spacing a frame
BLOCK = box((2.0, 1.0, 0.6))
LID = box((2.0, 0.5, 0.6), center=(0.0, 0.74, 0.0))


def swung(points, angle):
    return (points - HINGE) @ Rotation.from_rotvec([0, 0, angle]).as_matrix().T + HINGE


def volume(angle):
    return sample_volume(joined(BLOCK, LID.moved(swung(LID.vertices, angle))), SETTINGS.resolution, SETTINGS.centers)


VOLUMES = [volume(angle) for angle in ANGLES]


@pytest.fixture(scope="module")
def states():
    states = [first_frame(VOLUMES[0], SETTINGS)]
    for before, now in zip(VOLUMES, VOLUMES[1:]):
        states.append(tracked_on(states[-1], now, SETTINGS, lambda volume=before: volume))
    return states


def same(one, other):
    return np.array_equal(one.centers, other.centers) and one.steps == other.steps


def error_of(state, start, angle):
    """(C,) distance of each center, in s, from where its part has carried it; straddling centers may go with either."""
    part = start[:, 1, None] - 0.5
    distance = np.linalg.norm(state.centers - np.where(part > 0, swung(start, angle), start), axis=1) / state.affinity.spacing
    return np.where(np.abs(part[:, 0]) > 0.3 * state.affinity.spacing, distance, 0.0)


def test_centers_go_with_their_part_and_none_stays_in_the_gap(states):
    start = states[1].centers
    for angle, now, state in zip(ANGLES[2:], VOLUMES[2:], states[2:]):
        assert not in_gaps(state.centers, now, state.affinity.spacing).any()
        assert error_of(state, start, angle).max() < 0.6


def test_forward_tracking_alone_leaves_centers_behind(states):
    state = next_frame(states[1], VOLUMES[2], SETTINGS)
    assert in_gaps(state.centers, VOLUMES[2], state.affinity.spacing).sum() > 3
    assert error_of(state, states[1].centers, ANGLES[2]).max() > 0.8


def test_pairs_across_the_gap_no_longer_pull(states):
    spacing, weights = states[0].affinity.spacing, states[-1].affinity.weights()
    start = states[1].centers
    free = start[:, 0] > 0.5
    lid, block = free & (start[:, 1] > 0.5 + 0.3 * spacing), free & (start[:, 1] < 0.5 - 0.3 * spacing)
    assert near_pairs(start, spacing).weights()[lid][:, block].nnz > 0
    assert weights[lid][:, block].sum() < 0.01 * weights[lid][:, lid].sum()


def test_nothing_changes_where_no_gap_opens(states):
    twin = next_frame(states[0], VOLUMES[1], SETTINGS)
    assert same(states[1], twin) and states[1].receded == 0


def test_what_vanishes_is_no_gap(states):
    """The lid is gone: its centers stay where they are, and nobody tries again before more are left behind."""
    gone = sample_volume(BLOCK, SETTINGS.resolution, SETTINGS.centers)
    state = tracked_on(states[1], gone, SETTINGS, lambda: VOLUMES[1])
    assert same(state, next_frame(states[1], gone, SETTINGS)) and state.receded > 0
    assert tracked_on(state, gone, SETTINGS, pytest.fail).receded == state.receded


def test_the_volume_before_is_not_made_where_it_is_not_known(states):
    assert same(tracked_on(states[1], VOLUMES[2], SETTINGS, None), next_frame(states[1], VOLUMES[2], SETTINGS))


def test_pairs_agree_unless_a_point_of_their_line_is_in_a_gap(states):
    centers, now, spacing = states[-1].centers, VOLUMES[-1], states[0].affinity.spacing
    pairs = near_pairs(centers, spacing)
    agreement = without_gaps(pairs, centers, now).agreement
    for first, second, value in zip(pairs.first[::50], pairs.second[::50], agreement[::50]):
        line = [centers[first] + share * (centers[second] - centers[first]) for share in LINE]
        assert value == (0.0 if any(in_gaps(point[None], now, spacing)[0] for point in line) else 1.0)
    assert_array_equal(np.unique(agreement), [0.0, 1.0])
