"""Centers of a body that jumps reach it again as one; where nothing jumps, nothing changes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from refmesh_addon.core.settings import TrackingSettings
from refmesh_addon.core.tracking import lloyd
from refmesh_addon.core.tracking.first_guess import JUMP, first_guess
from refmesh_addon.core.tracking.forward import first_frame, next_frame
from refmesh_addon.core.tracking.ownership import Ownership
from refmesh_addon.core.tracking.volume import sample_volume

from ..shapes import box, joined, moved

SETTINGS = TrackingSettings(centers=80, resolution=48)
BODY = joined(box((3.0, 0.8, 0.6)), box((0.5, 0.5, 1.6), center=(1.1, 0.1, 0.9)), box((0.5, 1.5, 0.4), center=(-1.0, 0.9, 0.0)))
VOLUME = sample_volume(BODY, SETTINGS.resolution, SETTINGS.centers)
SPACING = VOLUME.center_spacing(SETTINGS.centers)
FIRST = first_frame(VOLUME, SETTINGS)


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_centers_keep_their_places_in_a_body_that_jumps(angle):
    turn, shift = Rotation.from_rotvec(angle * np.array([0.3, 0.9, 0.2])).as_matrix(), np.array([5.0, -3.0, 2.0])
    volume = sample_volume(moved(BODY, turn, shift), SETTINGS.resolution, SETTINGS.centers)
    state = next_frame(FIRST, volume, SETTINGS)
    error = np.linalg.norm(state.centers - (FIRST.centers @ turn.T + shift), axis=1) / SPACING
    assert np.median(error) < 0.15 and error.max() < 0.4


def test_what_does_not_jump_keeps_its_prediction():
    predicted = FIRST.centers + 0.3 * SPACING
    level = sample_volume(moved(BODY, shift=(0.4 * SPACING, 0.0, 0.0)), SETTINGS.resolution, SETTINGS.centers).levels[0]
    assert first_guess(FIRST.centers, predicted, FIRST.cells, level, SPACING) is predicted


@pytest.mark.parametrize("shift", [7.0, 4.0])
def test_a_body_that_appears_moves_no_other(shift):
    there = joined(BODY, moved(BODY, shift=(0.0, shift, 0.0)))
    level = sample_volume(there, SETTINGS.resolution, SETTINGS.centers).levels[0]
    assert lloyd.cells(FIRST.centers, Ownership(level)).energy > JUMP * FIRST.cells.energy
    assert first_guess(FIRST.centers, FIRST.centers, FIRST.cells, level, SPACING) is FIRST.centers
