"""Centers are born with a body that comes and retired with one that leaves; those of other bodies do not notice."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.settings import TrackingSettings
from refmesh_addon.core.tracking.forward import first_frame, next_frame
from refmesh_addon.core.tracking.population import Change, advanced
from refmesh_addon.core.tracking.volume import sample_volume
from tests.core.shapes import ball, box, joined

SETTINGS = TrackingSettings(centers=60, resolution=48)
STEP = np.array([0.1, 0.0, 0.0])


def volume(mesh):
    return sample_volume(mesh, SETTINGS.resolution, SETTINGS.centers)


def body(step):
    return box((2.0, 1.2, 0.8), 3, STEP * step)


def prop(step, radius=0.6):
    return ball(3, radius, (0.0, 2.5, 0.0) + STEP * step)


@pytest.fixture(scope="module")
def alone():
    return [volume(body(step)) for step in range(3)]


def with_prop(state, step):
    whole = volume(joined(body(step), prop(step)))
    return advanced(state, whole, Change(None, prop(step), volume(body(step))), SETTINGS)


def test_a_body_that_comes_has_as_many_centers_as_its_volume_holds(alone):
    state = with_prop(first_frame(alone[0], SETTINGS), 1)
    inside = np.linalg.norm(state.centers - prop(1).vertices.mean(axis=0), axis=1) < 0.6
    expected = 60 * (4 / 3 * np.pi * 0.6**3) / (2.0 * 1.2 * 0.8)
    assert abs(inside.sum() - expected) < 2
    assert_array_equal(inside, np.arange(len(inside)) >= 60)
    assert state.dfu < 0.3, "all are equally fine"


def test_the_centers_of_other_bodies_move_as_if_nothing_had_come(alone):
    first = first_frame(alone[0], SETTINGS)
    assert_array_equal(with_prop(first, 1).centers[:60], next_frame(first, alone[1], SETTINGS).centers)
    weights = with_prop(first, 1).affinity.weights()
    assert weights[:60, 60:].nnz == 0


def test_the_centers_of_a_body_that_leaves_stay_behind_and_the_others_move_on(alone):
    state = with_prop(first_frame(alone[0], SETTINGS), 1)
    left = advanced(state, alone[2], Change(prop(1), None, alone[2]), SETTINGS)
    assert_array_equal(left.active_centers, np.arange(len(state.centers)) < 60)
    assert_array_equal(left.centers[60:], state.centers[60:])
    assert_allclose((left.centers - state.centers)[:60].mean(axis=0), STEP, atol=0.02)
    assert left.dfu < 0.3


def test_something_comes_while_something_else_leaves(alone):
    state = with_prop(first_frame(alone[0], SETTINGS), 1)
    other = ball(3, 0.5, (0.0, -3.0, 0.0))
    whole = volume(joined(body(2), other))
    changed = advanced(state, whole, Change(prop(1), other, alone[2]), SETTINGS)
    assert_array_equal(changed.active_centers[:60], True)
    assert not changed.active_centers[60 : len(state.centers)].any() and changed.active_centers[len(state.centers) :].all()
    followed = advanced(changed, whole, Change(None, None, whole), SETTINGS)
    assert np.linalg.norm(followed.centers - changed.centers, axis=1)[changed.active_centers].max() < 0.1


def test_one_center_at_least_stays(alone):
    state = first_frame(alone[0], SETTINGS)
    assert advanced(state, alone[1], Change(body(0), None, alone[1]), SETTINGS).active_centers.all()
