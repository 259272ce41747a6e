"""Owners kept up to date, against asking for every sample again."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from refmesh_addon.core.tracking.ownership import NEIGHBORS, Ownership
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


@pytest.mark.parametrize("count", [2, 5, NEIGHBORS, NEIGHBORS + 1, NEIGHBORS + 2, 200])
def test_owners_stay_right_where_some_centers_run_far_and_others_rest(count):
    ownership, centers, runners = Ownership(SAMPLES), RNG.random((count, 3)), RNG.random(count) < 0.2
    centers[0] = centers[-1]
    direction = RNG.normal(size=3)
    for _ in range(12):
        distance, nearest = cKDTree(centers).query(SAMPLES.positions)
        owners = ownership.of(centers)
        assert_allclose(np.linalg.norm(SAMPLES.positions - centers[owners], axis=1), distance, rtol=1e-12)
        unique = ~np.isin(nearest, [0, count - 1])  # two centers in one place are equally near
        assert_array_equal(owners[unique], nearest[unique])
        centers = centers + runners[:, None] * 0.1 * direction


def test_few_samples_are_queried_again_where_little_moves(monkeypatch):
    ownership, centers, queried = Ownership(SAMPLES), RNG.random((200, 3)), []
    query = Ownership._query
    monkeypatch.setattr(Ownership, "_query", lambda self, chosen, centers: queried.append(chosen) or query(self, chosen, centers))
    ownership.of(centers)
    centers = centers.copy()
    centers[7] += 0.02
    ownership.of(centers)
    assert len(queried) == 2 and len(queried[1]) < 0.2 * len(SAMPLES.positions), "most are far from what moved"


def test_a_single_center_owns_everything():
    ownership = Ownership(SAMPLES)
    for centers in (np.zeros((1, 3)), np.ones((1, 3))):
        assert_array_equal(ownership.of(centers), 0)
