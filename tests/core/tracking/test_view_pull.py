"""Where a view ends, its border does not drag centers over the body; where a body ends, it still does."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from refmesh_addon.core.tracking.forward import first_frame, next_frame
from refmesh_addon.core.tracking.ownership import Ownership
from refmesh_addon.core.tracking.view_pull import KEPT, border_directions, near_cells
from tests.core.shapes import box

from .views import SETTINGS, seen_along_z, sheet, view

THICKNESS = 0.08


def test_directions_point_into_the_view_along_the_sheet_and_only_beside_its_border():
    volume = view(sheet(2.0), THICKNESS)
    spacing = volume.center_spacing(SETTINGS.centers)
    centers = np.array([[1.0, 0.5, -0.04], [0.0, 0.5, -0.04], [1.0, 1.0, -0.06], [0.9 * spacing, 0.5, -0.01], [9.0, 9.0, 9.0]])
    directions = border_directions(centers, volume.finest, spacing)
    lengths = (directions**2).sum(axis=1)
    assert lengths[0] == 0.0 and lengths[4] == 0.0, "inside of the view, and where there is nothing"
    assert_allclose(lengths[[1, 2]], 1.0 - KEPT)
    assert_allclose(directions[1] / np.sqrt(1.0 - KEPT), [1.0, 0.0, 0.0], atol=0.1)
    assert_allclose(directions[2] / np.sqrt(1.0 - KEPT), [0.0, -1.0, 0.0], atol=0.1)
    assert 0.0 < lengths[3] < 1.0 - KEPT


def test_near_cells_have_what_is_near_and_nearest():
    samples = view(sheet(1.0), THICKNESS).levels[0]
    centers = np.array([[0.2, 0.2, 0.0], [0.7, 0.6, 0.0], [5.0, 5.0, 0.0]])
    masses, centroids = near_cells(centers, Ownership(samples), 0.25)
    distances = np.linalg.norm(samples.positions[:, None] - centers, axis=2)
    for index in range(2):
        chosen = (distances.argmin(axis=1) == index) & (distances[:, index] < 0.25)
        assert_allclose(masses[index], samples.masses[chosen].sum())
        assert_allclose(centroids[index], np.average(samples.positions[chosen], axis=0, weights=samples.masses[chosen]))
    assert masses[2] == 0.0


def test_centers_turn_with_a_body_whose_outline_stays():
    body, steps = box((1.6, 1.6, 0.8), 4), [Rotation.from_rotvec([0.0, np.radians(8 * step), 0.0]).as_matrix() for step in range(5)]
    volumes = [view(seen_along_z(body.moved(body.vertices @ turn.T)), 0.1) for turn in steps]

    def slipped(is_view):
        state = first_frame(volumes[0], SETTINGS)
        first = state.centers
        for volume in volumes[1:]:
            state = next_frame(state, replace(volume, is_view=is_view), SETTINGS)
        return np.median(np.linalg.norm(state.centers - first @ steps[-1].T, axis=1)) / state.affinity.spacing

    assert slipped(True) < min(0.12, 0.4 * slipped(False))


def test_a_sheet_that_slides_in_its_plane_takes_its_centers_along():
    volumes = [view(sheet(1.4).moved(sheet(1.4).vertices + [0.06 * step, 0.0, 0.0]), THICKNESS) for step in range(7)]
    state = first_frame(volumes[0], SETTINGS)
    first, lags = state.centers, []
    for step, volume in enumerate(volumes[1:], 1):
        state = next_frame(state, volume, SETTINGS)
        lags.append(np.median(np.linalg.norm(state.centers - first - [0.06 * step, 0.0, 0.0], axis=1)) / state.affinity.spacing)
    assert max(lags) < 0.5 and lags[-1] < 1.2 * max(lags[:3]), "it does not add up"
