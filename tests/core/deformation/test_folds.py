"""Folded triangles are turned back, and nothing else is touched."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.deformation import folds
from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.deformation.facing import Facing
from refmesh_addon.core.deformation.folds import unfolded
from refmesh_addon.core.geometry.mesh import mean_edge_length, triangle_areas
from tests.core.bending_bar import FOLDED, bar, bent, with_folds
from tests.core.shapes import TILT

REFERENCE = bar(30, 16, uneven=0.1)
SOLVER = ArapSolver(REFERENCE)
UNROTATED = np.tile(np.eye(3), (len(REFERENCE.vertices), 1, 1))


def test_folds_are_turned_back_and_all_else_stays():
    pose = bent(REFERENCE.vertices)
    rotations = SOLVER.deform([0], pose[:1], pose, iterations=0).rotations
    folded = with_folds(REFERENCE, pose)
    assert Facing(REFERENCE, rotations).folded(folded).any()
    result = unfolded(SOLVER, folded, pose, Facing(REFERENCE, rotations))
    assert not Facing(REFERENCE, rotations).folded(result).any()
    far = np.linalg.norm(pose[:, None] - pose[FOLDED], axis=2).min(axis=1) > 6 * mean_edge_length(REFERENCE)
    assert 20 < far.sum()
    assert_array_equal(result[far], folded[far])


def test_a_finer_mesh_gives_way_as_far_as_a_coarse_one(monkeypatch):
    """Not as few edges: its folds have as many more of them."""
    fine = bar(120, 64, uneven=0.1)
    near = np.linalg.norm(fine.vertices - fine.vertices[3000], axis=1)
    push = 7.0 * mean_edge_length(fine) * np.exp(-((near / (3.0 * mean_edge_length(fine))) ** 2))
    folded, rotations = fine.vertices + push[:, None] * [1.0, 0.0, 0.0], np.tile(np.eye(3), (len(fine.vertices), 1, 1))
    left = []
    for edge in (0.0, 4.0 * mean_edge_length(fine) / np.sqrt(triangle_areas(fine).sum())):
        monkeypatch.setattr(folds, "EDGE", edge)
        result = unfolded(ArapSolver(fine), folded, fine.vertices, Facing(fine, rotations))
        left.append(Facing(fine, rotations).folded(result).sum())
    assert left[0] > left[1] == 0


def test_what_no_camera_saw_may_leave_its_place():
    """Folds deeper than the surface may give way are turned back in a contact only."""
    folded = REFERENCE.vertices.copy()
    folded[FOLDED] += 4.0 * mean_edge_length(REFERENCE) * np.array([1.0, 0.0, 0.0])
    facing, hidden = Facing(REFERENCE, UNROTATED), np.linalg.norm(REFERENCE.vertices - folded[FOLDED[0]], axis=1) < 1.0
    assert not hidden[FOLDED[1]]
    left = [facing.folded(unfolded(SOLVER, folded, REFERENCE.vertices, facing, which)) for which in (None, hidden)]
    at_hidden = hidden[REFERENCE.triangles].all(axis=1)
    assert (left[0] & at_hidden).any() and not (left[1] & at_hidden).any()
    assert_array_equal(left[0][~at_hidden], left[1][~at_hidden])
    assert left[1].any()


def test_a_surface_without_folds_is_given_back():
    pose = bent(REFERENCE.vertices)
    rotations = SOLVER.deform([0], pose[:1], pose, iterations=0).rotations
    assert unfolded(SOLVER, pose, pose, Facing(REFERENCE, rotations)) is pose


def test_turning_and_scaling_the_problem_does_so_to_the_answer():
    folded, change = with_folds(REFERENCE, REFERENCE.vertices), lambda points: 50.0 * points @ TILT.T + [3.0, -7.0, 11.0]
    plain = unfolded(SOLVER, folded, REFERENCE.vertices, Facing(REFERENCE, UNROTATED))
    carried = ArapSolver(REFERENCE.moved(change(REFERENCE.vertices)))
    assert_allclose(unfolded(carried, change(folded), carried.mesh.vertices, Facing(carried.mesh, UNROTATED)), change(plain), atol=1e-6)
