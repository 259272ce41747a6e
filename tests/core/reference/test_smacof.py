"""SMACOF against a plain loop, and configurations that it must recover."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from refmesh_addon.core.reference import smacof as module
from refmesh_addon.core.reference.reference_centers import largest_distances, rigidly_aligned
from refmesh_addon.core.reference.smacof import near_weights, smacof, stress

from .parting_frames import distances, parting_frames, random_frames, random_points


def guttman_by_loop(points, largest):
    """One step of De Leeuw 1977, pair by pair."""
    moved = np.zeros_like(points)
    for i in range(len(points)):
        for j in range(len(points)):
            if i != j:
                apart = points[i] - points[j]
                moved[i] += largest[i, j] * apart / np.linalg.norm(apart)
    return moved / len(points)


def test_steps_same_as_a_loop(monkeypatch):
    largest, points = largest_distances(random_frames()), random_points(seed=5)
    monkeypatch.setattr(module, "MAX_STEPS", 3)
    expected = points - points.mean(axis=0)
    for _ in range(3):
        expected = guttman_by_loop(expected, largest)
    assert_allclose(smacof(largest, points), expected, atol=1e-12)


def test_stress_never_rises(monkeypatch):
    largest, history = largest_distances(parting_frames()), []
    for steps in range(1, 60):
        monkeypatch.setattr(module, "MAX_STEPS", steps)
        history.append(stress(smacof(largest, parting_frames()[0]), largest))
    assert (np.diff(history) <= 1e-12).all()
    assert history[-1] < 0.5 * history[0]


def test_an_exact_configuration_is_recovered_up_to_a_rigid_motion():
    points = random_points()
    disturbed = points + 0.05 * np.random.default_rng(3).normal(size=points.shape)
    recovered = smacof(distances(points), disturbed)
    assert stress(recovered, distances(points)) < 2e-3
    assert stress(disturbed, distances(points)) > 0.05
    assert_allclose(rigidly_aligned(recovered, points), points, atol=0.02)


def test_weighted_steps_same_as_with_the_pseudo_inverse(monkeypatch):
    largest, points = largest_distances(random_frames()), random_points(seed=5)
    monkeypatch.setattr(module, "MAX_STEPS", 3)
    weights = near_weights(largest)
    inverse = np.linalg.pinv(np.diag(weights.sum(axis=1)) - weights)
    expected = points - points.mean(axis=0)
    for _ in range(3):
        ratio = np.divide(weights * largest, distances(expected), out=np.zeros_like(largest), where=weights > 0)
        expected = inverse @ ((np.diag(ratio.sum(axis=1)) - ratio) @ expected)
    assert_allclose(smacof(largest, points, weights=weights), expected, atol=1e-10)
    alike = 1.0 - np.eye(len(points))
    assert_allclose(smacof(largest, points, weights=alike), smacof(largest, points), atol=1e-10)


def test_weights_do_not_depend_on_scale_or_coincidence():
    largest = distances(random_frames()[0])
    assert_allclose(near_weights(1e3 * largest), near_weights(largest), rtol=1e-12)
    assert near_weights(largest).mean() == pytest.approx(1.0)
    assert np.isfinite(near_weights(np.zeros((4, 4)))).all()
