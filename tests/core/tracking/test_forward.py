"""Tracking bodies whose motion is known, meshed anew on every frame."""

from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from refmesh_addon.core.settings import TrackingSettings
from refmesh_addon.core.tracking import lloyd
from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.tracking.forward import TrackedFrame, first_frame, next_frame
from refmesh_addon.core.tracking.ownership import Ownership
from refmesh_addon.core.tracking.volume import sample_volume

from ..shapes import QUARTER_TURN, STILL, ball, box, joined, moved

SETTINGS = TrackingSettings(centers=60, resolution=40)
IIR = replace(SETTINGS, affinity="iir")
BODY = joined(box(), box((0.5, 0.5, 0.9), center=(0.9, 0.2, 0.7)))  # two boxes that overlap: nothing about it is symmetric
SPACING = sample_volume(BODY, SETTINGS.resolution, SETTINGS.centers).center_spacing(SETTINGS.centers)


def meshed(turn, shift, step):
    """The body in its place, with other triangles on each frame."""
    fine = joined(box(subdivisions=step % 3), box((0.5, 0.5, 0.9), subdivisions=(step + 1) % 3, center=(0.9, 0.2, 0.7)))
    return moved(fine, turn, shift)


def volume_of(mesh, settings=SETTINGS):
    return sample_volume(mesh, settings.resolution, settings.centers)


def tracked(meshes, settings=SETTINGS):
    states = []
    for mesh in meshes:
        volume = volume_of(mesh, settings)
        states.append(next_frame(states[-1], volume, settings) if states else first_frame(volume, settings))
    return states


MOTIONS = {
    "shift": [(STILL, SPACING * step * np.array([0.5, 0.3, -0.2])) for step in range(5)],
    "turn": [(Rotation.from_rotvec([0.1 * step, 0.05 * step, 0]).as_matrix(), np.zeros(3)) for step in range(5)],
    "both": [(Rotation.from_rotvec([0, 0, 0.08 * step]).as_matrix(), SPACING * step * np.array([0.0, 0.4, 0.0])) for step in range(5)],
}


@pytest.mark.parametrize("settings", [SETTINGS, IIR], ids=["max", "iir"])
@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS.keys())
def test_a_rigid_body_carries_its_centers_rigidly(motion, settings):
    states = tracked([meshed(turn, shift, step) for step, (turn, shift) in enumerate(motion)], settings)
    for (turn, shift), state in zip(motion, states):
        error = np.linalg.norm(state.centers - (states[0].centers @ turn.T + shift), axis=1) / SPACING
        assert np.median(error) < 0.15
        assert error.max() < 0.3
    assert states[-1].dfu < states[0].dfu + 0.05
    assert states[-1].affinity.agreement.min() > 0.9


def test_what_stands_still_stays():
    states = tracked([meshed(STILL, np.zeros(3), step) for step in range(4)])
    drift = np.linalg.norm(states[-1].centers - states[0].centers, axis=1) / SPACING
    assert np.median(drift) < 0.03
    assert drift.max() < 0.1
    assert states[-1].arap_energy < 1e-4


def stretched(mesh, share):
    return mesh.moved(mesh.vertices * [1 + share, 1.0, 1.0])


def test_centers_follow_a_stretch_and_stay_even():
    states = tracked([stretched(BODY, 0.05 * min(step, 4)) for step in range(9)])
    followed = np.ptp(states[-1].centers[:, 0]) / np.ptp(states[0].centers[:, 0]) - 1
    assert 0.1 < followed < 0.21, "rigidity holds back, but not for good"
    assert states[-1].dfu < 0.25
    assert states[4].arap_energy > 0


def moved_cells(cells, scale, turn, shift):
    centroids, second = scale * cells.centroids @ turn.T + shift, scale**2 * turn @ cells.second @ turn.T
    return replace(cells, centroids=centroids, second=second, energy=scale**2 * cells.energy)


def moved_state(state, scale, turn, shift):
    """The same tracking, had the input been scaled, turned and moved."""
    change = lambda points: scale * points @ turn.T + shift
    return replace(
        state,
        centers=change(state.centers),
        before=change(state.before),
        affinity=replace(state.affinity, spacing=scale * state.affinity.spacing),
        cells=moved_cells(state.cells, scale, turn, shift),
    )


@pytest.mark.parametrize(
    ("scale", "turn", "shift", "voxels", "share"),
    # The grid is turned against the axes, and a turned body has other voxels.
    [(1e-3, STILL, 0.0, 1e-5, 1e-4), (10.0, STILL, 0.0, 1e-5, 1e-4), (1.0, STILL, 30.0, 1e-5, 1e-4), (1.0, QUARTER_TURN, 0.0, 0.3, 0.1)],
    ids=["small", "large", "far", "turned"],
)
def test_scaling_turning_and_moving_the_input_does_the_same_to_the_result(scale, turn, shift, voxels, share):
    meshes = [meshed(*motion, step) for step, motion in enumerate(MOTIONS["both"][:3])]
    changed = [moved(mesh, turn, (shift,) * 3, scale) for mesh in meshes]
    first, second, third = tracked(meshes)
    twin = moved_state(second, scale, turn, shift)
    state = next_frame(twin, volume_of(changed[2]), SETTINGS)
    expected = moved_state(third, scale, turn, shift)
    assert_allclose(state.centers, expected.centers, atol=voxels * volume_of(changed[2]).voxel)
    if turn is STILL:
        assert_allclose(state.affinity.values(), third.affinity.values(), atol=1e-6)
        assert state.steps == third.steps
    for name in ("dfu", "lloyd_energy", "arap_energy"):
        assert getattr(state, name) == pytest.approx(getattr(third, name), rel=share)


def test_bodies_that_meet_and_part_keep_their_centers():
    gaps = [0.6, 0.3, 0.02, 0.02, 0.3, 0.6]  # two of them below a voxel
    meshes = [joined(moved(ball(2), shift=(-1 - gap / 2, 0, 0)), moved(ball(3), shift=(1 + gap / 2, 0, 0))) for gap in gaps]
    states = tracked(meshes)
    left = states[0].centers[:, 0] < 0
    for state in states:
        assert_array_equal(state.centers[:, 0] < 0, left)
    weights = states[-1].affinity.weights().toarray()
    assert weights[left][:, ~left].max() < 0.3
    strongest = [np.sort(weights[side][:, side], axis=1)[:, -2] for side in (left, ~left)]  # after each center's own 1
    assert np.median(np.concatenate(strongest)) > 0.5


def test_a_body_that_vanishes_leaves_no_center_undefined_and_none_outside():
    states = tracked([joined(ball(2), ball(2, 0.5, (2.0, 0, 0))), ball(2), ball(2)])
    assert all(np.isfinite(state.centers).all() for state in states)
    assert (states[-1].centers[:, 0] < 1.2).all()
    assert states[-1].dfu < 1.0


def test_figures_are_those_of_the_centers():
    first, second = tracked([BODY, stretched(BODY, 0.1)])
    cells = lloyd.cells(second.centers, Ownership(volume_of(stretched(BODY, 0.1)).finest))
    assert second.dfu == cells.non_uniformity
    assert second.lloyd_energy == pytest.approx(cells.energy / SPACING**2)
    assert (first.arap_energy, first.steps) == (0.0, 0)
    assert second.steps > 0
    assert_array_equal(second.before, first.centers)
    assert_array_equal(first.affinity.values(), near_pairs(first.centers, first.affinity.spacing).values())


def test_the_same_input_gives_the_same_bytes():
    meshes = [BODY, stretched(BODY, 0.1)]
    first, again = tracked(meshes)[-1], tracked(meshes)[-1]
    for field in fields(TrackedFrame):
        if field.name not in ("affinity", "cells"):
            assert_array_equal(getattr(first, field.name), getattr(again, field.name))
    assert_array_equal(first.affinity.values(), again.affinity.values())
    assert_array_equal(first.cells.masses, again.cells.masses)


def test_more_centers_than_samples_on_the_coarse_levels():
    settings = TrackingSettings(centers=300, resolution=16)
    states = tracked([BODY, stretched(BODY, 0.1)], settings)
    assert np.isfinite(states[-1].centers).all()
    assert len(volume_of(BODY, settings).levels) < 3
