"""Feature vertices and the lines of a frame: the closest point on a line that runs along, the corner for a corner, nothing far away."""

import numpy as np
import pytest

from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.deformation.correspondence import Correspondence, SurfaceIndex, SurfaceSampler
from refmesh_addon.core.deformation.feature_targets import FeatureTargets
from refmesh_addon.core.deformation.surface_fit import Unpaired, fit_surface
from refmesh_addon.core.geometry.feature_lines import feature_edges
from refmesh_addon.core.geometry.mesh import mean_edge_length
from refmesh_addon.core.surfacing.hole_caps import without_holes

from ..shapes import TILT, ball, box, moved

SIDES = np.array([2.0, 1.2, 0.8])
REFERENCE = moved(box(SIDES, subdivisions=4), TILT)
FEATURES = feature_edges(REFERENCE).edges
LENGTH = mean_edge_length(REFERENCE)


def off_the_edges(points):
    beyond = np.abs(np.abs(points @ TILT) - SIDES / 2)
    return np.sqrt((np.sort(beyond, axis=1)[:, :2] ** 2).sum(axis=1))


@pytest.fixture(scope="module")
def targets():
    return FeatureTargets(FEATURES, without_holes(moved(box(SIDES), TILT)), LENGTH)


def test_goals_lie_on_the_lines_and_corners_go_to_corners(targets):
    disturbed = REFERENCE.moved(REFERENCE.vertices + 0.2 * LENGTH * np.random.default_rng(0).normal(size=REFERENCE.vertices.shape))
    vertices, goals = targets.goals(disturbed)
    assert len(vertices) > 0.95 * len(np.unique(FEATURES))
    assert off_the_edges(goals).max() < 1e-9
    corners = np.abs(REFERENCE.vertices[vertices] @ TILT) > SIDES / 2 - 1e-9
    at_corner = corners.all(axis=1)
    assert at_corner.sum() == 8
    assert np.abs(goals[at_corner] - REFERENCE.vertices[vertices[at_corner]]).max() < 1e-9


def test_a_line_far_away_or_across_is_no_goal(targets):
    vertices, _ = targets.goals(REFERENCE.moved(REFERENCE.vertices + [0, 5, 0]))
    assert not len(vertices)


def test_what_must_not_be_paired_is_not(targets):
    frame = without_holes(moved(box(SIDES), TILT))
    refusing = FeatureTargets(FEATURES, frame, LENGTH, lambda vertices, triangles: np.zeros(len(vertices), dtype=bool))
    vertices, _ = refusing.goals(REFERENCE)
    assert np.isin(vertices, np.unique(FEATURES)).all()
    assert len(vertices) <= 8, "corners only, which are found by distance"


def test_a_fit_makes_edges_straight():
    wave = 0.3 * LENGTH * np.sin(7 * REFERENCE.vertices[:, [1, 2, 0]])
    source = moved(box(SIDES, subdivisions=4), TILT)
    start = REFERENCE.vertices + wave
    correspondence = Correspondence(SurfaceIndex(source), SurfaceSampler(REFERENCE))
    fit = lambda lines: fit_surface(ArapSolver(REFERENCE), start, correspondence, unpaired=Unpaired(lines)).vertices[np.unique(FEATURES)]
    off = off_the_edges(fit(FeatureTargets(FEATURES, without_holes(source), LENGTH))).max()
    assert off < 5e-4 * source.diagonal
    assert off_the_edges(fit(None)).max() > 2 * off


def test_a_frame_without_lines_has_no_goals():
    round_frame = FeatureTargets(FEATURES, without_holes(moved(ball(2), TILT)), LENGTH)
    assert not len(round_frame.goals(REFERENCE)[0])
