"""Owners kept up to date, against asking for every sample again."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from refmesh_addon.core.tracking.ownership import Ownership
from refmesh_addon.core.tracking.volume import VolumeSamples

RNG = np.random.default_rng(0)
SAMPLES = VolumeSamples(RNG.random((3000, 3)), np.ones(3000), 0.01)


@pytest.mark.parametrize("size", [0.3, 0.03, 0.001, 0.0])
def test_owners_are_the_nearest_centers_however_far_they_moved(size):
    ownership, centers = Ownership(SAMPLES), RNG.random((40, 3))
    for _ in range(6):
        distance, nearest = cKDTree(centers).query(SAMPLES.positions)
        assert_array_equal(ownership.of(centers), nearest)
        assert_allclose(ownership.distances(centers), distance, rtol=1e-12)
        centers = centers + size * RNG.normal(size=centers.shape)


def test_a_single_center_owns_everything():
    ownership = Ownership(SAMPLES)
    for centers in (np.zeros((1, 3)), np.ones((1, 3))):
        assert_array_equal(ownership.of(centers), 0)
