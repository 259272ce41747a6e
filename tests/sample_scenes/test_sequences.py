"""The synthetic sequences: the motion they state is that of the surfaces they give."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from sample_scenes.generators import SEQUENCES

# Number of connected surfaces at the start, in the middle and at the end.
COMPONENTS = {"tumble": (1, 1, 1), "beam": (1, 1, 1), "bar": (1, 1, 1), "bend": (1, 1, 1), "twist": (1, 1, 1), "appear": (1, 2, 2)}
COMPONENTS |= {"gears": (2, 2, 2), "engaged": (1, 1, 1), "walk": (1, 1, 1), "lift": (1, 1, 1)}
COMPONENTS |= {"collide": (2, 1, 2), "clasp": (2, 1, 2), "grasp": (2, 1, 2)}

OVERLAPPING = {"lift"}  # parts overlap where they are fused, and a point there goes with the one or the other


def components(mesh) -> int:
    start, end = mesh.triangles.ravel(), np.roll(mesh.triangles, 1, axis=1).ravel()
    return connected_components(coo_matrix((np.ones(len(start)), (start, end)), shape=(len(mesh.vertices),) * 2))[0]


def points_inside(sequence, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Points of the bodies that are there, and their bodies."""
    points = np.random.default_rng(0).uniform(-1, 1, (20_000, 3)) * sequence.reach + sequence.center
    there = [number for number, body in enumerate(sequence.bodies) if body.start <= time]
    depth = np.array([sequence.bodies[number].distance(points, time) for number in there])
    inside = depth.min(axis=0) < 0
    return points[inside], np.array(there)[depth[:, inside].argmin(axis=0)]


@pytest.mark.parametrize("name", SEQUENCES)
def test_bodies_touch_and_part(name):
    sequence = SEQUENCES[name]()
    assert tuple(components(sequence.frame(time, seed=1)) for time in (0.0, 0.5, 1.0)) == COMPONENTS[name]


@pytest.mark.parametrize("name", sorted(SEQUENCES.keys() - OVERLAPPING))
@pytest.mark.parametrize("time", [0.0, 0.4, 1.0])
def test_rest_undoes_motion(name, time):
    sequence = SEQUENCES[name]()
    points, labels = points_inside(sequence, time)
    assert len(points) > 20
    rest = sequence.rest(points, labels, time)
    assert_allclose(sequence.motion(rest, labels, time), points, atol=1e-9 * sequence.reach)


@pytest.mark.parametrize("name", sorted(SEQUENCES.keys() - OVERLAPPING - {"engaged"}))  # whose surface in a contact is that of neither body
def test_motion_carries_each_surface_onto_the_later_one(name):
    sequence = SEQUENCES[name]()
    start = max(body.start for body in sequence.bodies)
    vertices = sequence.frame(start, seed=1).vertices
    labels = sequence.labels(vertices, start)
    rest = sequence.rest(vertices, labels, start)
    for number, body in enumerate(sequence.bodies):
        later = sequence.motion(rest, labels, 0.8)[labels == number]
        surface = np.abs(body.distance(later, 0.8)) < 1e-6 * sequence.reach
        assert surface.all()


@pytest.mark.parametrize("name", SEQUENCES)
def test_no_two_frames_share_vertices(name):
    first, second = (SEQUENCES[name]().frame(0.0, seed) for seed in (1, 2))
    assert not {tuple(row) for row in first.vertices.round(9)} & {tuple(row) for row in second.vertices.round(9)}
