"""Cuts of a take: what must fall together, and what must not."""

import tracemalloc

import numpy as np
import pytest
from scipy import sparse

from refmesh_addon.core.reference.grouping import TOUCHING, Contacts, content_groups, frame_stress, least_strained_cut
from refmesh_addon.core.tracking.affinity import near_pairs

SPACING = 1.0
BLOCK = np.stack(np.meshgrid(*[np.arange(4.0)] * 3), axis=-1).reshape(-1, 3)


def affinity_of(*blocks):
    """Affinity within each block, none across."""
    return sparse.block_diag([near_pairs(block, SPACING).weights() for block in blocks]).tocsr()


def still(frames):
    return np.repeat(BLOCK[None], frames, axis=0)


def bending(frames, amount=0.02):
    """A block that is sheared more and more."""
    shear = amount * np.arange(frames)[:, None] * BLOCK[:, 2] ** 2
    return still(frames) + np.stack([shear, 0 * shear, 0 * shear], axis=-1)


def meeting(gaps):
    """Two blocks, the second above the first by a gap in each frame."""
    return np.stack([np.vstack([BLOCK, BLOCK + [0.0, 0.0, 4.0 + gap]]) for gap in gaps])


def lengths(groups):
    return [len(group) for group in groups]


@pytest.mark.parametrize(("frames", "longest"), [(1, 1), (7, 3), (12, 5), (10, 10)])
def test_groups_hold_every_frame_once_and_none_is_too_long(frames, longest):
    groups = content_groups(bending(frames), affinity_of(BLOCK), SPACING, longest)
    assert [index for group in groups for index in group] == list(range(frames))
    assert max(lengths(groups)) <= longest


def test_a_body_that_only_moves_is_one_group():
    turned = still(9) @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]) + np.arange(9)[:, None, None]
    assert len(content_groups(turned, affinity_of(BLOCK), SPACING, 20)) == 1


def test_the_more_it_deforms_the_shorter_the_groups():
    counts = [len(content_groups(bending(12, amount), affinity_of(BLOCK), SPACING, 12)) for amount in (0.0, 0.01, 0.03, 0.1)]
    assert counts == sorted(counts)
    assert counts[0] == 1
    assert counts[-1] > 3


def test_bodies_that_move_apart_count_as_no_deformation():
    frames = meeting(np.linspace(3.0, 20.0, 9))
    assert len(content_groups(frames, affinity_of(BLOCK, BLOCK), SPACING, 20)) == 1


def test_no_group_is_in_contact_throughout_where_another_cut_avoids_that():
    gaps = [2.0] * 4 + [0.0] * 6 + [2.0] * 4
    frames = meeting(gaps)
    contacts = Contacts.of(frames, affinity_of(BLOCK, BLOCK), SPACING)
    assert [len(pairs) > 0 for pairs in contacts.touching] == [gap < TOUCHING for gap in gaps]
    groups = content_groups(frames, affinity_of(BLOCK, BLOCK), SPACING, 7)
    assert all(contacts.lasting(group[0], group[-1] + 1)[-1] == 0 for group in groups)
    assert lengths(groups) == [7, 7]


def test_cuts_that_are_given_are_made():
    groups = content_groups(still(10), affinity_of(BLOCK), SPACING, 20, cuts=(3, 4))
    assert lengths(groups) == [3, 1, 6]


def test_scale_changes_nothing():
    frames = bending(12, 0.03)
    assert content_groups(1e3 * frames, affinity_of(BLOCK), 1e3, 12) == content_groups(frames, affinity_of(BLOCK), 1.0, 12)


def test_an_empty_group_is_refused():
    with pytest.raises(ValueError, match="at least one frame"):
        content_groups(still(3), affinity_of(BLOCK), SPACING, 0)


def test_a_run_is_cut_where_both_parts_deform_least():
    rest = np.random.default_rng(0).random((30, 3))
    positions = np.stack([rest * [1 + 0.01 * frame, 1, 1] + (frame >= 4) * rest[:, [1, 2, 0]] for frame in range(7)])
    assert least_strained_cut(positions, sparse.csr_matrix(np.ones((30, 30))), [2, 4, 6]) == 4


def test_where_a_run_is_cut_is_where_the_stress_of_both_parts_is_least():
    positions = still(12) + 0.3 * np.random.default_rng(1).standard_normal((12, *BLOCK.shape)).cumsum(axis=0)
    weights = affinity_of(BLOCK)
    stress = [sum(frame_stress(part, weights).sum() for part in (positions[:cut], positions[cut:])) for cut in range(1, 12)]
    for candidates in ([1, 2, 3], [4, 7, 9], range(1, 12)):
        assert least_strained_cut(positions, weights, list(candidates)) == min(candidates, key=lambda cut: stress[cut - 1])


@pytest.mark.parametrize("function", [content_groups, frame_stress, least_strained_cut])
def test_memory_does_not_grow_with_the_take(function):
    """Distances between all centers are hundreds of times as large as their positions."""
    centers = np.random.default_rng(0).random((300, 3)) * 6.7
    weights, rest = near_pairs(centers, SPACING).weights(), {content_groups: (SPACING, 5), frame_stress: (), least_strained_cut: ([9, 11],)}
    peaks = []
    for frames in (20, 80):
        positions = np.repeat(centers[None], frames, axis=0)
        tracemalloc.start()
        function(positions, weights, *rest[function])
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0]


def test_the_stress_of_a_frame_is_what_it_is_deformed_against_the_largest_distances():
    growing = np.array([1.0, 1.1, 1.3])[:, None, None] * BLOCK
    first, second, last = frame_stress(growing, affinity_of(BLOCK))
    assert first > second > last == 0
    assert np.allclose(frame_stress(still(3) + np.arange(3)[:, None, None], affinity_of(BLOCK)), 0)
