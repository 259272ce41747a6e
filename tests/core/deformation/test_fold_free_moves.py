"""Moves toward a goal go as far as nothing folds."""

import numpy as np

from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.deformation.facing import Facing
from refmesh_addon.core.deformation.fold_free_moves import moved_without_folds
from tests.core.bending_bar import bar, bent, with_folds

REFERENCE = bar(30, 16, uneven=0.1)
UNROTATED = np.tile(np.eye(3), (len(REFERENCE.vertices), 1, 1))


def test_vertices_go_to_a_goal_that_folds_nothing():
    goal = bent(REFERENCE.vertices)
    rotations = ArapSolver(REFERENCE).deform([0], goal[:1], goal, iterations=0).rotations
    assert moved_without_folds(Facing(REFERENCE, rotations), REFERENCE.vertices, goal) is goal
    assert moved_without_folds(Facing(REFERENCE, rotations), goal, goal) is goal


def test_vertices_stop_short_of_folding_and_the_others_arrive():
    start = REFERENCE.vertices
    goal = with_folds(REFERENCE, start) + [0.0, 0.02, 0.0]
    assert Facing(REFERENCE, UNROTATED).folded(goal).any()
    moved = moved_without_folds(Facing(REFERENCE, UNROTATED), start, goal)
    assert not Facing(REFERENCE, UNROTATED).folded(moved).any()
    left = np.linalg.norm(goal - moved, axis=1) / np.maximum(np.linalg.norm(goal - start, axis=1), 1e-300)
    assert (left == 0).mean() > 0.9
    assert 0.01 < left.max() <= 1.0
