"""Centers are born in what comes into view and retired out of view, but not for a strip at the border."""

import numpy as np

from refmesh_addon.core.tracking.forward import first_frame
from refmesh_addon.core.tracking.population import followed
from refmesh_addon.core.tracking.view_changes import repopulated

from .views import SETTINGS, sheet, view

THICKNESS = 0.08


def part(start, end):
    """What is seen of a rippled sheet that stays where it is."""
    flat = sheet(end - start).vertices + [start, 0.0, 0.0]
    ripples = 0.1 * np.sin(6.0 * flat[:, 0]) * np.cos(5.0 * flat[:, 1])
    return view(sheet(end - start).moved(flat + ripples[:, None] * [0.0, 0.0, 1.0]), THICKNESS)


def followed_through(windows):
    """States of a sheet of which another part is seen in each frame."""
    volumes = [part(start, end) for start, end in windows]
    states = [first_frame(volumes[0], SETTINGS)]
    for volume in volumes[1:]:
        states.append(repopulated(followed(states[-1], volume, SETTINGS), volume))
    return states


def test_new_surface_has_as_many_centers_as_its_volume_holds_and_belongs_to_the_body():
    first, *_, state = followed_through([(0.0, 1.2), (0.0, 1.35), (0.0, 1.5), (0.0, 1.65), (0.0, 1.8)])
    born = state.centers[120:]
    assert abs(len(born) - 120 * 0.6 / 1.2) < 20
    assert (born[:, 0] > 1.2).all() and state.active_centers.all()
    assert np.median(np.linalg.norm(state.centers[:120] - first.centers, axis=1)) < 0.3 * state.affinity.spacing, "the others stay"
    weights = state.affinity.weights()
    assert weights[:120, 120:].nnz and (weights != weights.T).nnz == 0


def test_centers_out_of_view_are_retired_once_others_are_born():
    first, *_, state = followed_through([(start, start + 1.2) for start in np.arange(0.0, 0.7, 0.1)])
    gone = ~state.active_centers
    assert gone[:120].sum() > 20 and not gone[120:].any() and len(state.centers) > 140
    assert (first.centers[gone[:120], 0] < 0.6).all()


def test_a_strip_at_the_border_changes_nothing():
    state = first_frame(part(0.0, 1.2), SETTINGS)
    for volume in (part(0.0, 1.25), part(0.1, 1.2)):
        assert repopulated(state, volume) is state
