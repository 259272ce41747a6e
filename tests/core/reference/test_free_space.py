"""Beyond the surface of an anchor frame, what few frames show does not count; what most of them show does."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.spatial import cKDTree

from refmesh_addon.core.geometry.mesh import sample_surface
from refmesh_addon.core.reference.cap_points import OrientedPoints, counting
from refmesh_addon.core.reference.free_space import LEAST, FreeSpace, in_most_frames

from ..shapes import TILT, box, without

SPACING = 0.2
ABOVE = np.array([0.1, 0.05, 0.0])


def free_space(mesh):
    return FreeSpace(mesh, cKDTree(sample_surface(mesh, 20_000, np.random.default_rng(0))[0]), SPACING)


@pytest.fixture(scope="module")
def block():
    return box((2, 2, 1), subdivisions=3)


def test_free_space_begins_above_the_surface_and_ends_where_other_bodies_may_be(block):
    heights = np.array([-0.4, -0.1, 0.0, 0.1, 0.3]) + 0.5
    places = np.array([ABOVE + [0, 0, height] for height in (*heights, 0.5 + 3.0 * SPACING)])
    assert_array_equal(free_space(block).holds(places), [False, False, False, 0.1 > LEAST * SPACING, True, False])
    turned = block.moved(block.vertices @ TILT.T)
    assert_array_equal(free_space(turned).holds(places @ TILT.T), free_space(block).holds(places))


def test_beyond_the_rim_of_a_tear_nothing_is_known(block):
    torn = without(block, block.vertices[block.triangles][:, :, 0].min(axis=1) > 0.4)
    places = np.array([[0.6, 0.0, 0.7], [0.2, 0.0, 0.7]])
    assert_array_equal(free_space(torn).holds(places), [False, True])


def test_a_majority_is_more_than_half_of_all_frames():
    here, near, elsewhere = np.zeros((1, 3)), np.full((1, 3), 0.2 * LEAST * SPACING), np.ones((1, 3))
    nothing = np.zeros((0, 3))
    assert [shown.tolist() for shown in in_most_frames([here, near, elsewhere, nothing], SPACING)] == [[False], [False], [False], []]
    assert [shown.tolist() for shown in in_most_frames([here, near, near, elsewhere], SPACING)] == [[True]] * 3 + [[False]]
    assert not in_most_frames([here, nothing], SPACING)[0].any()


@pytest.mark.parametrize("showing", [1, 4])
def test_only_what_most_frames_show_in_free_space_counts(block, showing):
    """A finger that the anchor frame, the first of six, does not have."""
    surface, free = sample_surface(block, 500, np.random.default_rng(0))[0], free_space(block)
    finger = ABOVE + np.column_stack([np.zeros((20, 2)), np.linspace(0.4, 1.2, 20)])
    frames = []
    for frame in range(6):
        points = np.concatenate([surface, finger]) if 0 < frame <= showing else surface
        unmarked = np.zeros(len(points), dtype=bool)
        frames.append(OrientedPoints(points, points, unmarked, np.full(len(points), -1, dtype=np.int32), free.holds(points)))
    counts = [len(part.points) for part in counting(frames, 0, SPACING)]
    dropped = 0 if showing > 3 else np.count_nonzero(free.holds(finger))
    assert counts == [len(frame.points) - (dropped if 0 < index <= showing else 0) for index, frame in enumerate(frames)]
