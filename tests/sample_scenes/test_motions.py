"""Motions: the inverse undoes them, and what each is said to keep stays."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sample_scenes.generators.motions import Bend, Chain, Rigid, Squash, Twist, Undo

RIGID = Rigid((1, 2, 3), lambda t: 2.0 * t, lambda t: (t, -t, 0.5))
SQUASH = Squash(lambda t: 1.0 - 0.4 * t)
TWIST = Twist(lambda t: 1.2 * t)
BEND = Bend(3.0, lambda t: 2.5 * t)
MOTIONS = {
    "rigid": RIGID,
    "squash": SQUASH,
    "twist": TWIST,
    "bend": BEND,
    "undo": Undo(TWIST),
    "chain": Chain((TWIST, BEND, RIGID)),
}


def slab(rng, count=400) -> np.ndarray:
    """Points of a bar along x, thinner than any radius of curvature used here."""
    return rng.uniform((-0.5, -0.4, -0.4), (3.5, 0.4, 0.4), (count, 3))


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("time", [0.0, 0.3, 1.0])
def test_inverse_undoes_forward(name, time):
    points = slab(np.random.default_rng(0))
    assert_allclose(MOTIONS[name].inverse(MOTIONS[name].forward(points, time), time), points, atol=1e-12)


@pytest.mark.parametrize("name", ["squash", "twist"])
def test_volume_is_kept(name):
    points, step = slab(np.random.default_rng(1)), 1e-6
    columns = [(MOTIONS[name].forward(points + d, 0.7) - MOTIONS[name].forward(points - d, 0.7)) / (2 * step) for d in np.eye(3) * step]
    assert_allclose(np.linalg.det(np.stack(columns, axis=-1)), 1.0, atol=1e-8)


def test_bend_keeps_the_length_of_its_middle_line_and_is_smooth_at_both_ends():
    line = np.column_stack([np.linspace(-1.0, 4.0, 20_001), np.zeros(20_001), np.zeros(20_001)])
    steps = np.diff(BEND.forward(line, 1.0), axis=0)
    assert_allclose(np.linalg.norm(steps, axis=1), 5.0 / 20_000, rtol=1e-6)
    assert np.linalg.norm(np.diff(steps, axis=0), axis=1).max() < 1e-6  # no kink: directions turn by a ten-thousandth at most
