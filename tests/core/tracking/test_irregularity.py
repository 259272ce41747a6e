"""Irregularity against its plain twin, and how many trajectories it drops."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.tracking.irregularity import MAX_DROPPED_SHARE, irregularity, regular_centers

from .rigid_sequence import shaken


def test_irregularity_against_its_plain_twin():
    positions = shaken() + 1e3
    distance = ((positions[:, :, None] - positions[:, None]) ** 2).sum(axis=3).mean(axis=0)
    np.fill_diagonal(distance, np.inf)
    assert_allclose(irregularity(positions), distance.min(axis=1), rtol=1e-6)
    assert_array_equal(irregularity(positions[:, :1]), [0.0])


def test_no_more_than_a_few_are_dropped_at_a_time():
    positions = np.random.default_rng(0).uniform(size=(3, 1000, 3))
    positions[:, ::50] += 100 * np.arange(20)[:, None]
    assert len(regular_centers(positions)) == 1000 - np.ceil(1000 * MAX_DROPPED_SHARE)
