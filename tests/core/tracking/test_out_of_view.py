"""Centers out of view go with those in view: exactly where all is rigid, and as they bend where it bends."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from refmesh_addon.core.tracking.affinity import near_pairs
from refmesh_addon.core.tracking.out_of_view import carried_out_of_view

SPACING = 0.1
REST = np.stack(np.meshgrid(np.arange(12), np.arange(4), np.arange(3), indexing="ij"), axis=-1).reshape(-1, 3) * SPACING
WEIGHTS = near_pairs(REST, SPACING).weights()
ACTIVE = np.ones((7, len(REST)), dtype=bool)
ACTIVE[4:, REST[:, 0] < 0.35] = False  # retired
ACTIVE[:3, REST[:, 0] > 0.75] = False  # not yet born


def seen(truth):
    """Positions as they are tracked: born and retired centers stay where they are first and last."""
    held = truth.copy()
    for frame in range(1, len(truth)):
        held[frame, ~ACTIVE[frame] & ACTIVE[0]] = held[frame - 1, ~ACTIVE[frame] & ACTIVE[0]]
    for frame in range(len(truth) - 2, -1, -1):
        held[frame, ~ACTIVE[frame] & ACTIVE[-1]] = held[frame + 1, ~ACTIVE[frame] & ACTIVE[-1]]
    return held


def test_rigid_motion_carries_them_exactly_and_leaves_the_others():
    turns = [Rotation.from_rotvec([0.1 * frame, 0.05 * frame, 0.0]).as_matrix() for frame in range(7)]
    truth = np.stack([REST @ turn.T + [0.2 * frame, 0.0, 0.0] for frame, turn in enumerate(turns)])
    carried = carried_out_of_view(seen(truth), ACTIVE, WEIGHTS)
    assert_array_equal(carried[ACTIVE], truth[ACTIVE])
    assert_allclose(carried, truth, atol=1e-4 * SPACING)
    assert np.abs(seen(truth) - truth).max() > SPACING


def bent_by(curvature):
    """The bar along an arc; its middle layer keeps its lengths."""
    angles, radii = curvature * (REST[:, 0] - 0.55), 1.0 / curvature - (REST[:, 2] - SPACING)
    return np.column_stack([radii * np.sin(angles), REST[:, 1], 1.0 / curvature - radii * np.cos(angles)])


def test_a_body_that_bends_carries_them_without_stretching():
    bent = np.stack([bent_by(0.2 * frame + 0.1) + [0.0, 0.1 * frame, 0.0] for frame in range(7)])
    carried, pairs = carried_out_of_view(seen(bent), ACTIVE, WEIGHTS), WEIGHTS.tocoo()
    retired = np.flatnonzero((REST[pairs.row, 0] < 0.35) & (REST[pairs.col, 0] < 0.45) & (REST[pairs.col, 0] > REST[pairs.row, 0]))
    lengths = np.linalg.norm((carried[:, pairs.row] - carried[:, pairs.col])[:, retired], axis=2)
    assert np.abs(lengths[4:] - lengths[3]).max() < 0.1 * SPACING
    lengths = np.linalg.norm((seen(bent)[:, pairs.row] - seen(bent)[:, pairs.col])[:, retired], axis=2)
    assert np.abs(lengths[4:] - lengths[3]).max() > 0.5 * SPACING


def test_what_nothing_in_view_holds_goes_with_the_nearest():
    apart = np.vstack([REST, REST[:5] + [0.0, 0.0, 9.0]])
    active = np.pad(ACTIVE, ((0, 0), (0, 5)), constant_values=True)
    active[5:, -5:] = False
    truth = np.stack([apart + [0.0, 0.3 * frame, 0.0] for frame in range(7)])
    held = truth.copy()
    held[5:, -5:] = held[4, -5:]
    weights = near_pairs(apart, SPACING).weights()
    assert_allclose(carried_out_of_view(held, active, weights)[:, -5:], truth[:, -5:], atol=1e-6)
