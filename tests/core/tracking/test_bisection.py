"""Parts of equal mass that turn, move and scale with the body."""

import numpy as np
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

from refmesh_addon.core.tracking.bisection import equal_parts
from refmesh_addon.core.tracking.volume import VolumeSamples

from ..shapes import TILT

RNG = np.random.default_rng(0)
POSITIONS = RNG.random((6000, 3)) ** [1.0, 1.3, 1.6] * [3.0, 1.7, 1.0]
MASSES = RNG.integers(1, 9, 6000).astype(float)


def test_parts_have_the_same_mass():
    for count in (2, 7, 60):
        parts = equal_parts(VolumeSamples(POSITIONS, MASSES, 0.1), count)
        whole = MASSES @ POSITIONS / MASSES.sum()
        assert_allclose(parts.mean(axis=0), whole, atol=0.01)


def test_parts_follow_a_body_that_is_turned_moved_and_scaled():
    change = lambda points: 10.0 * points @ TILT.T + [5.0, -70.0, 2.0]
    plain = equal_parts(VolumeSamples(POSITIONS, MASSES, 0.1), 60)
    changed = equal_parts(VolumeSamples(change(POSITIONS), MASSES, 1.0), 60)
    assert_allclose(changed, change(plain), atol=1e-9)


def test_more_parts_than_samples_share_their_places():
    parts = equal_parts(VolumeSamples(POSITIONS[:5], MASSES[:5], 0.1), 12)
    assert cKDTree(POSITIONS[:5]).query(parts)[0].max() < 1e-12
