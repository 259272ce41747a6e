"""The energy of a sequence against its parts, and its minimum for a center that nothing holds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse

from refmesh_addon.core.tracking import lloyd
from refmesh_addon.core.tracking.ownership import Ownership
from refmesh_addon.core.tracking.rigid_misfit import RigidMisfit
from refmesh_addon.core.tracking.sequence_energy import RIGIDITY, minimized

from .rigid_sequence import EVEN, FRAMES, SPACING, carried, samples_of, shaken, weights_of


def test_the_energy_is_that_of_the_positions_returned():
    state, energies = minimized(shaken(), weights_of(shaken()), samples_of, SPACING)
    misfit = RigidMisfit(weights_of(shaken()))
    arap = [misfit(*state.positions[[frame - 1, frame]])[0] / SPACING**2 for frame in range(1, FRAMES)]
    spread = [lloyd.cells(centers, Ownership(samples_of(frame))).energy / SPACING**2 for frame, centers in enumerate(state.positions)]
    assert_allclose(state.arap_energy, [0, *arap])
    assert_allclose(state.lloyd_energy, spread)
    assert energies[-1] == pytest.approx(sum(spread) + RIGIDITY * sum(arap))


def test_a_center_without_volume_or_neighbors_stays_defined():
    positions = np.concatenate([carried(EVEN), np.full((FRAMES, 1, 3), 3.0 * SPACING)], axis=1)
    state, _ = minimized(positions, sparse.block_diag([weights_of(carried(EVEN)), [[1.0]]]).tocsr(), samples_of, SPACING)
    assert np.isfinite(state.positions).all()
