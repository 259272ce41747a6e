"""Exposure: a known gain comes back, whatever a minority of texels shows."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from refmesh_addon.core.color.exposure import evened, exposed, gain_between

GAIN = np.array([1.1, 0.9, 1.25])
RNG = np.random.default_rng(0)
COLORS = RNG.integers(30, 180, (5000, 3), dtype=np.uint8)
SEEN = np.ones(len(COLORS), bool)


def test_known_gain_comes_back():
    assert_allclose(gain_between(exposed(COLORS, GAIN), COLORS, SEEN), GAIN, rtol=2e-3)


def test_what_a_minority_shows_does_not_matter():
    changed = exposed(COLORS, GAIN)
    changed[:1500] = RNG.integers(0, 256, (1500, 3))
    assert_allclose(gain_between(changed, COLORS, SEEN), GAIN, rtol=0.05)


def test_unseen_texels_are_not_compared():
    changed, seen = exposed(COLORS, GAIN), SEEN.copy()
    changed[:4000], seen[:4000] = 255 - changed[:4000], False
    assert_allclose(gain_between(changed, COLORS, seen), GAIN, rtol=5e-3)


def test_clipped_and_black_pictures_give_no_gain():
    assert gain_between(np.full((500, 3), 255, np.uint8), COLORS[:500], SEEN[:500]).tolist() == [1, 1, 1]


def test_unit_gain_changes_nothing():
    assert np.array_equal(exposed(COLORS, np.ones(3)), COLORS)


def test_take_keeps_its_exposure():
    gains = evened([GAIN, GAIN**2, 1 / GAIN])
    assert_allclose(np.log(gains).sum(axis=0), 0, atol=1e-12)
    assert gains[1] / gains[0] == pytest.approx(GAIN)
