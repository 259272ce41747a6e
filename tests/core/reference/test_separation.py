"""Separation of bodies: how far, which, and what stays as it is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import sparse
from scipy.spatial.distance import cdist, pdist

from refmesh_addon.core.reference.separation import MIN_BODY, MIN_GAP, bodies_of, separated, within_bodies
from refmesh_addon.core.tracking.affinity import near_pairs

from ..shapes import TILT


def block(shape, corner=(0.0, 0.0, 0.0)):
    """Centers of a block, one apart."""
    return np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 3) + np.asarray(corner)


def scene(*blocks):
    """(C, 3) centers of blocks, and affinities within each of them only."""
    return np.concatenate(blocks), sparse.block_diag([near_pairs(one, 1.0).weights() for one in blocks]).tocsr()


def taken_apart(positions, affinity, spacing):
    return separated(positions, bodies_of(positions, affinity), spacing)


def gap(one, other):
    return cdist(one, other).min()


TOUCHING = scene(block((6, 4, 4)), block((3, 3, 3), (6, 0, 0)))


def test_bodies_that_touch_come_apart_and_keep_their_shapes():
    positions, affinity = TOUCHING
    placed = taken_apart(positions, affinity, 1.0)
    assert gap(placed[:96], placed[96:]) >= MIN_GAP * (1 - 1e-6)
    assert gap(placed[:96], placed[96:]) < 1.5 * MIN_GAP
    for body in (slice(0, 96), slice(96, None)):
        assert_allclose(pdist(placed[body]), pdist(positions[body]), atol=1e-9)
    moves = np.linalg.norm(placed - positions, axis=1)
    assert moves[:96].max() < moves[96:].min(), "the larger one moves less"


def test_bodies_apart_already_and_a_single_body_stay():
    far = scene(block((3, 3, 3)), block((3, 3, 3), (2 + MIN_GAP, 0, 0)))
    assert_array_equal(taken_apart(*far, 1.0), far[0])
    whole = scene(block((6, 4, 4)))
    assert_array_equal(taken_apart(*whole, 1.0), whole[0])


def test_done_again_nothing_moves():
    positions, affinity = TOUCHING
    once = taken_apart(positions, affinity, 1.0)
    assert_array_equal(taken_apart(once, affinity, 1.0), once)


def test_a_few_isolated_centers_count_with_the_nearest_body():
    positions, affinity = scene(block((6, 4, 4)), block((1, 1, MIN_BODY - 1), (6, 0, 0)))
    assert_array_equal(taken_apart(positions, affinity, 1.0), positions)
    assert_array_equal(bodies_of(positions, affinity), np.zeros(len(positions), dtype=int))


def test_three_in_a_row_all_come_apart():
    positions, affinity = scene(*(block((3, 3, 3), (3 * k, 0, 0)) for k in range(3)))
    placed = taken_apart(positions, affinity, 1.0)
    parts = np.split(placed, 3)
    assert min(gap(parts[0], parts[1]), gap(parts[1], parts[2]), gap(parts[0], parts[2])) >= MIN_GAP * (1 - 1e-6)


def test_what_is_inside_a_shell_ends_in_finite_positions():
    shell = block((5, 5, 5))
    shell = shell[(np.abs(shell - 2).max(axis=1) == 2)]
    positions, affinity = scene(shell * 2.0, block((3, 3, 3), (3, 3, 3)))
    assert np.isfinite(taken_apart(positions, affinity, 1.0)).all()


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scaling_turning_and_moving_carry_over(scale):
    positions, affinity = TOUCHING
    change = lambda points: scale * points @ TILT.T + scale * 7.0
    assert_allclose(taken_apart(change(positions), affinity, scale), change(taken_apart(positions, affinity, 1.0)), atol=1e-6 * scale)


def test_a_weak_link_joins_no_bodies_and_nothing_is_left_between_them():
    positions, affinity = TOUCHING
    linked = affinity.tolil()
    linked[90, 96] = linked[96, 90] = 0.05
    body = bodies_of(positions, linked.tocsr())
    assert_array_equal(body, np.repeat([0, 1], [96, 27]))
    assert (within_bodies(linked.tocsr(), body) != affinity).nnz == 0
    linked[90, 96] = linked[96, 90] = 0.5
    assert not bodies_of(positions, linked.tocsr()).any()
