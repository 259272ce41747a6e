"""Bodies that touch all the time: their motion shows that they are several, and no joint, bend or twist is taken for a contact."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.spatial.transform import Rotation

from refmesh_addon.core.reference.bodies_by_gaps import GapBodies
from refmesh_addon.core.reference.bodies_by_motion import bodies_by_motion
from sample_scenes.generators import SEQUENCES
from sample_scenes.generators.motions import Bend, Chain, Rigid, Twist

STEP = 0.1
TIMES = np.linspace(0.0, 1.0, 9)


def grid(low, high) -> np.ndarray:
    """(N, 3) centers that fill a box, shaken a little."""
    axes = [np.arange(a + STEP / 2, b, STEP) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return points + np.random.default_rng(len(points)).uniform(-0.2, 0.2, points.shape) * STEP


def carried(parts: list, times=TIMES) -> tuple[np.ndarray, np.ndarray]:
    """(F, C, 3) centers of parts, pairs of points and motion, and (C,) the part of each."""
    positions = np.stack([np.concatenate([motion.forward(points, time) for points, motion in parts]) for time in times])
    return positions, np.repeat(np.arange(len(parts)), [len(points) for points, _ in parts])


def bodies(positions: np.ndarray) -> np.ndarray:
    return bodies_by_motion(positions, STEP, GapBodies.known(np.zeros(positions.shape[1], dtype=int))).bodies


def agreement(one: np.ndarray, other: np.ndarray) -> float:
    """Share of the centers in which two divisions in two agree."""
    same = np.mean(one == other)
    return max(same, 1.0 - same)


@pytest.mark.parametrize("turn", [0.4, 1.0])
def test_gears_whose_surfaces_are_one_are_two_bodies(turn):
    sequence = SEQUENCES["engaged"]()
    points = grid((-1.3, -1.3, -0.35), (3.4, 1.3, 0.35))
    points = points[np.min([body.distance(points, 0.0) for body in sequence.bodies], axis=0) < -STEP / 3]
    labels = sequence.labels(points, 0.0)
    rest = sequence.rest(points, labels, 0.0)
    result = bodies(np.stack([sequence.motion(rest, labels, time) for time in turn * TIMES]))
    assert result.max() == 1 and agreement(result, labels) > 0.98


def test_a_box_that_slides_over_another_is_a_body():
    slide = Rigid((0, 0, 1), lambda t: 0.0, lambda t: (0.5 * t, 0.3 * t, 0.0))
    parts = [(grid((0, 0, 0), (2, 1.5, 0.6)), Chain(())), (grid((0.3, 0.3, 0.6), (1.2, 1, 1.2)), slide)]
    positions, truth = carried(parts)
    assert agreement(bodies(positions), truth) == 1.0


BAR = grid((0, -0.3, -0.2), (3, 0.3, 0.2))
HINGE = Rigid((0, 1, 0), lambda t: -2.0 * t, lambda t: (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    "parts",
    [
        [(BAR, Bend(3.0, lambda t: 2.6 * t))],
        [(BAR, Twist(lambda t: 1.2 * t))],
        [(BAR - [1.2, 0, 0], Bend(0.5, lambda t: 2.2 * t))],
        [(grid((-1.5, -0.3, -0.3), (0, 0.3, 0.3)), Chain(())), (grid((0, -0.3, -0.3), (1.5, 0.3, 0.3)), HINGE)],
        [(grid((-1.5, -0.3, -0.3), (0, 0.3, 0.3)), Chain(())), (grid((0, -0.2, -0.2), (1, 0.2, 0.2)), Twist(lambda t: 2.0 * t))],
    ],
    ids=["bend", "twist", "elbow", "hinge", "neck"],
)
def test_what_bends_or_twists_stays_one_body(parts):
    assert not bodies(carried(parts)[0]).any()


def test_an_arm_that_slides_over_the_chest_stays_with_its_body():
    """Shown apart, the contact would cut the arm off at its root, where the two belong together."""
    trunk, arm = grid((-0.6, -0.4, -2), (0.6, 0.4, 0)), grid((-0.2, 0.4, -1.8), (0.2, 0.8, 0.0))
    swing = Rigid((0, 1, 0), lambda t: 1.2 * t, lambda t: (0.0, 0.0, 0.0))
    root = grid((-0.2, -0.4, 0), (0.2, 0.8, 0.4))
    positions, _ = carried([(trunk, Chain(())), (arm, swing), (root, Chain(()))])
    assert not bodies(positions).any()


def test_scale_and_place_change_nothing_and_known_bodies_stay():
    slide = Rigid((0, 0, 1), lambda t: 0.0, lambda t: (0.5 * t, 0.3 * t, 0.0))
    far = Rigid((0, 0, 1), lambda t: t, lambda t: (9.0, 0.0, 0.0))
    box = grid((0.3, 0.3, 0.6), (1.2, 1, 1.2))
    positions, truth = carried([(grid((0, 0, 0), (2, 1.5, 0.6)), Chain(())), (box, slide), (box, far)])
    known = GapBodies.known((truth == 2).astype(int))
    result = bodies_by_motion(positions, STEP, known)
    assert_array_equal(np.unique(np.stack([truth, result.bodies]), axis=1).shape, (2, 3))
    assert_array_equal(result.rows[[0, 2]], [[0, 8], [0, 8]])
    assert_array_equal(result.by_motion, [True, False, True])
    turned = 40.0 * positions @ Rotation.from_rotvec([0.3, 0.2, 1.0]).as_matrix().T + 700.0
    assert_array_equal(bodies_by_motion(turned, 40.0 * STEP, known).bodies, result.bodies)
