"""The misfit of rigid motion against its definition, and its gradients against finite differences."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse

from refmesh_addon.core.geometry.rotations import rigid_motions
from refmesh_addon.core.tracking.rigid_misfit import RigidMisfit

from ..shapes import TILT


def plain_misfit(weights, before, after):
    motions = rigid_motions(weights, before, after)
    total = 0.0
    for i, row in enumerate(weights.toarray()):
        images = (before - motions.sources[i]) @ motions.rotations[i].T + motions.targets[i]
        total += row @ ((images - after) ** 2).sum(axis=1) / row.sum()
    return total / len(before)


@pytest.fixture
def pair():
    rng = np.random.default_rng(1)
    before = rng.normal(size=(9, 3))
    linked = rng.random((9, 9))
    weights = sparse.csr_matrix(np.maximum(linked, linked.T) * (linked + linked.T > 0.8) + np.eye(9))
    return weights, before, before @ TILT.T + 5.0 + 0.2 * rng.normal(size=(9, 3))


def test_misfit_is_the_mean_distance_missed_and_equal_both_ways(pair):
    weights, before, after = pair
    assert RigidMisfit(weights)(before, after)[0] == pytest.approx(plain_misfit(weights, before, after))
    assert RigidMisfit(weights)(after, before)[0] == pytest.approx(plain_misfit(weights, before, after))


def test_misfit_gradients_are_the_finite_differences(pair):
    weights, *pair = pair
    misfit, step = RigidMisfit(weights), 1e-5
    _, *gradients = misfit(*pair)
    for which, gradient in enumerate(gradients):
        slopes = np.empty(gradient.shape)
        for place in np.ndindex(slopes.shape):
            ends = []
            for side in (step, -step):
                changed = [points.copy() for points in pair]
                changed[which][place] += side
                ends.append(misfit(*changed)[0])
            slopes[place] = (ends[0] - ends[1]) / (2 * step)
        assert_allclose(2 / len(gradient) * gradient, slopes, atol=1e-8)
