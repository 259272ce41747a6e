"""Folded triangles: found wherever they are, turned back, and nothing else touched."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.deformation import folds
from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.deformation.folds import Facing, approached, folded_triangles, unfolded
from refmesh_addon.core.geometry.closest_point import SurfaceIndex
from refmesh_addon.core.geometry.mesh import mean_edge_length, triangle_areas, triangle_normals
from tests.core.bending_bar import bar, bent
from tests.core.shapes import TILT

REFERENCE = bar(30, 16, uneven=0.1)
SOLVER = ArapSolver(REFERENCE)
UNTURNED = np.tile(np.eye(3), (len(REFERENCE.vertices), 1, 1))


def with_folds(vertices, chosen):
    """Some vertices carried just across their neighbours."""
    moved = vertices.copy()
    moved[chosen] += 1.3 * mean_edge_length(REFERENCE) * np.array([1.0, 0.0, 0.0])
    return moved


def test_what_turns_as_told_is_not_folded():
    turned = np.tile(TILT, (len(REFERENCE.vertices), 1, 1))
    assert not folded_triangles(REFERENCE.moved(REFERENCE.vertices @ TILT.T), REFERENCE, turned).any()


def test_a_triangle_that_faces_the_wrong_way_is_found():
    moved = REFERENCE.moved(with_folds(REFERENCE.vertices, [100, 300]))
    expected = np.einsum("ij,ij->i", triangle_normals(moved), triangle_normals(REFERENCE)) < 0
    assert 2 <= expected.sum() < 20
    assert_array_equal(folded_triangles(moved, REFERENCE, UNTURNED), expected)


def test_what_curls_as_the_source_does_is_not_folded():
    moved = with_folds(REFERENCE.vertices, [100, 300])
    crumpled = SurfaceIndex(REFERENCE.moved(moved))
    facing = Facing(REFERENCE, UNTURNED, crumpled)
    assert facing.turned_over(moved).any()
    assert not facing.folded(moved).any()
    assert unfolded(SOLVER, moved, REFERENCE.vertices, UNTURNED, crumpled) is moved
    smooth = Facing(REFERENCE, UNTURNED, SurfaceIndex(REFERENCE))
    assert_array_equal(smooth.folded(moved), smooth.turned_over(moved))


def test_folds_are_turned_back_and_all_else_stays():
    pose = bent(REFERENCE.vertices)
    turns = SOLVER.deform([0], pose[:1], pose, iterations=0).rotations
    crossed = with_folds(pose, [100, 300])
    assert folded_triangles(REFERENCE.moved(crossed), REFERENCE, turns).any()
    result = unfolded(SOLVER, crossed, pose, turns)
    assert not folded_triangles(REFERENCE.moved(result), REFERENCE, turns).any()
    far = np.linalg.norm(pose[:, None] - pose[[100, 300]], axis=2).min(axis=1) > 6 * mean_edge_length(REFERENCE)
    assert 20 < far.sum()
    assert_array_equal(result[far], crossed[far])


def test_a_finer_mesh_gives_way_as_far_as_a_coarse_one(monkeypatch):
    """Not as few edges: its folds have as many more of them."""
    fine = bar(120, 64, uneven=0.1)
    near = np.linalg.norm(fine.vertices - fine.vertices[3000], axis=1)
    push = 7.0 * mean_edge_length(fine) * np.exp(-((near / (3.0 * mean_edge_length(fine))) ** 2))
    folded, turns = fine.vertices + push[:, None] * [1.0, 0.0, 0.0], np.tile(np.eye(3), (len(fine.vertices), 1, 1))
    left = []
    for edge in (0.0, 4.0 * mean_edge_length(fine) / np.sqrt(triangle_areas(fine).sum())):
        monkeypatch.setattr(folds, "EDGE", edge)
        result = unfolded(ArapSolver(fine), folded, fine.vertices, turns)
        left.append(folded_triangles(fine.moved(result), fine, turns).sum())
    assert left[0] > left[1] == 0


def test_a_surface_without_folds_is_given_back():
    pose = bent(REFERENCE.vertices)
    turns = SOLVER.deform([0], pose[:1], pose, iterations=0).rotations
    assert unfolded(SOLVER, pose, pose, turns) is pose


def test_turning_and_scaling_the_problem_does_so_to_the_answer():
    crossed, change = with_folds(REFERENCE.vertices, [100, 300]), lambda points: 50.0 * points @ TILT.T + [3.0, -7.0, 11.0]
    plain = unfolded(SOLVER, crossed, REFERENCE.vertices, UNTURNED)
    carried = ArapSolver(REFERENCE.moved(change(REFERENCE.vertices)))
    assert_allclose(unfolded(carried, change(crossed), carried.mesh.vertices, UNTURNED), change(plain), atol=1e-6)


def test_vertices_go_to_a_goal_that_folds_nothing():
    goal = bent(REFERENCE.vertices)
    turns = SOLVER.deform([0], goal[:1], goal, iterations=0).rotations
    assert approached(Facing(REFERENCE, turns), REFERENCE.vertices, goal) is goal
    assert approached(Facing(REFERENCE, turns), goal, goal) is goal


def test_vertices_stop_short_of_folding_and_the_others_arrive():
    start = REFERENCE.vertices
    goal = with_folds(start, [100, 300]) + [0.0, 0.02, 0.0]
    assert folded_triangles(REFERENCE.moved(goal), REFERENCE, UNTURNED).any()
    found = approached(Facing(REFERENCE, UNTURNED), start, goal)
    assert not folded_triangles(REFERENCE.moved(found), REFERENCE, UNTURNED).any()
    left = np.linalg.norm(goal - found, axis=1) / np.maximum(np.linalg.norm(goal - start, axis=1), 1e-300)
    assert (left == 0).mean() > 0.9
    assert 0.01 < left.max() <= 1.0
