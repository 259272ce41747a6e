"""As-rigid-as-possible deformation: laws of the energy, a slow plain twin, difficult meshes and refusals."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse

from refmesh_addon.core.deformation.arap import ArapSolver
from refmesh_addon.core.deformation.arap_system import Constraints, Start, Targets
from refmesh_addon.core.geometry.mesh import mean_edge_length, triangle_areas
from refmesh_addon.core.geometry.rotations import closest_rotations
from refmesh_addon.core.types import TriangleMesh
from tests.core.bending_bar import bar, bent

Q = closest_rotations(np.random.default_rng(8).normal(size=(1, 3, 3)))[0]


def joined(*meshes):
    shifts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    triangles = [mesh.triangles + shift for mesh, shift in zip(meshes, shifts, strict=True)]
    return TriangleMesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(triangles))


def end_handles(mesh):
    return np.flatnonzero(np.abs(mesh.vertices[:, 0]) > 1.8)


def energy_by_loops(mesh, smoothness, deformation, weights):
    """The data and smoothness terms exactly as the paper writes them, edge by edge; `weights` is a dense (R, R) table."""
    stiffness = smoothness * triangle_areas(mesh).sum()
    before, after, rotations = mesh.vertices, deformation.vertices, deformation.rotations
    total = 0.0
    for i, j in zip(*np.nonzero(weights), strict=True):
        total += weights[i, j] * np.sum((after[i] - after[j] - rotations[i] @ (before[i] - before[j])) ** 2)
        total += stiffness * np.sum((rotations[i] - rotations[j]) ** 2)
    return total


def deformed_by_loops(mesh, weights, handles, targets, start, weight, iterations):
    """Plain ARAP (no smoothness): one decomposition a vertex, and dense least squares over all edges."""
    count, edges = len(mesh.vertices), list(zip(*np.nonzero(weights), strict=True))
    before, after = mesh.vertices, start
    for _ in range(iterations):
        covariance = np.zeros((count, 3, 3))
        for i, j in edges:
            covariance[i] += weights[i, j] * np.outer(after[i] - after[j], before[i] - before[j])
        u, _, vt = np.linalg.svd(covariance)
        u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
        rotations = u @ vt
        left, right = np.zeros((len(edges) + len(handles), count)), np.zeros((len(edges) + len(handles), 3))
        for row, (i, j) in enumerate(edges):
            root = np.sqrt(weights[i, j])
            left[row, i], left[row, j], right[row] = root, -root, root * rotations[i] @ (before[i] - before[j])
        for row, (handle, target) in enumerate(zip(handles, targets, strict=True), start=len(edges)):
            left[row, handle], right[row] = np.sqrt(weight), np.sqrt(weight) * target
        after = np.linalg.lstsq(left, right, rcond=None)[0]
    return after


def test_plain_arap_same_as_a_slow_twin():
    mesh = bar(8, 6)
    handles = end_handles(mesh)
    solver = ArapSolver(mesh, smoothness=0.0)
    start = mesh.vertices + 0.05 * np.random.default_rng(0).normal(size=mesh.vertices.shape)
    targets = bent(mesh.vertices)[handles]
    fast = solver.deform(handles, targets, start, weight=3.0, iterations=4).vertices
    slow = deformed_by_loops(mesh, solver.energy.weights.toarray(), handles, targets, start, 3.0, 4)
    assert_allclose(fast, slow, atol=1e-9)


@pytest.mark.parametrize("smoothness", [0.0, 0.01])
def test_reported_energy_is_the_papers_sum(smoothness):
    mesh = bar(10, 8)
    solver, handles = ArapSolver(mesh, smoothness), end_handles(mesh)
    targets = bent(mesh.vertices)[handles]
    deformation = solver.deform(handles, targets, mesh.vertices, weight=2.0, iterations=3)
    handle_energy = 2.0 * np.sum((deformation.vertices[handles] - targets) ** 2)
    expected = energy_by_loops(mesh, smoothness, deformation, solver.energy.weights.toarray()) + handle_energy
    assert_allclose(deformation.energies[-1], expected, rtol=1e-9)


@pytest.mark.parametrize("smoothness", [0.0, 1e-4, 0.01, 1.0])
@pytest.mark.parametrize("weight", [0.1, 100.0, np.inf])
def test_energy_never_rises(smoothness, weight):
    mesh = joined(bar(), TriangleMesh(bar(10, 8).vertices + [0, 3, 0], bar(10, 8).triangles))
    handles = np.flatnonzero(np.abs(mesh.vertices[: len(bar().vertices), 0]) > 1.8)
    start = mesh.vertices + 0.3 * np.random.default_rng(1).normal(size=mesh.vertices.shape)
    energies = ArapSolver(mesh, smoothness).deform(handles, bent(mesh.vertices)[handles], start, weight, iterations=25).energies
    assert energies.shape == (26,)
    assert np.diff(energies).max() <= 1e-10 * energies[0]
    assert energies[-1] < 0.5 * energies[0]


def test_smooth_rotations_reach_a_minimum():
    mesh = bar(10, 8)
    solver, handles, rng = ArapSolver(mesh, 0.01), end_handles(mesh), np.random.default_rng(2)
    result = solver.deform(handles, bent(mesh.vertices)[handles], mesh.vertices, weight=np.inf, iterations=400)
    weights = solver.energy.weights.toarray()
    least = energy_by_loops(mesh, 0.01, result, weights)
    free = np.setdiff1d(np.arange(len(mesh.vertices)), handles)
    for _ in range(5):
        vertices = result.vertices.copy()
        vertices[free] += 1e-3 * rng.normal(size=(len(free), 3))
        rotations = closest_rotations(result.rotations + 1e-3 * rng.normal(size=result.rotations.shape))
        for changed in (replace(result, vertices=vertices), replace(result, rotations=rotations)):
            assert energy_by_loops(mesh, 0.01, changed, weights) > least


def test_energies_begin_with_that_of_the_start_where_its_rotations_are_given():
    mesh = bar(10, 8)
    solver, handles = ArapSolver(mesh, 0.01), end_handles(mesh)
    first = solver.deform(handles, bent(mesh.vertices)[handles], mesh.vertices, weight=2.0, iterations=3)
    rows = sparse.identity(len(mesh.vertices), format="csr")[handles]
    system = solver.system(Constraints.at_points(rows, np.full(len(handles), 2.0)))
    targets = Targets(bent(mesh.vertices)[handles])
    second = system.solve(targets, Start(first.vertices, first.rotations), 2)
    assert second.energies.shape == (3,)
    assert_allclose(second.energies[0], first.energies[-1], rtol=1e-9)
    whole = solver.deform(handles, targets.points, mesh.vertices, weight=2.0, iterations=5)
    assert_allclose(second.vertices, whole.vertices, atol=1e-9)


def test_a_solver_is_freed_with_its_last_reference():
    """Without waiting for the garbage collector: its factors are large."""
    solver = ArapSolver(bar(8, 6))
    solver.deform([0], np.zeros((1, 3)), solver.mesh.vertices)
    system = weakref.ref(solver._latest[1])
    gc.disable()
    try:
        del solver
        assert system() is None
    finally:
        gc.enable()


def test_smoothness_spreads_the_bend():
    mesh = bar()
    handles = end_handles(mesh)

    def sharpest_turn(smoothness):
        rotations = ArapSolver(mesh, smoothness).deform(handles, bent(mesh.vertices)[handles], mesh.vertices, np.inf, 50).rotations
        a, b = mesh.triangles[:, 0], mesh.triangles[:, 1]
        return np.linalg.norm(rotations[a] - rotations[b], axis=(1, 2)).max()

    assert sharpest_turn(0.01) < 0.8 * sharpest_turn(0.0)


def test_a_rigid_motion_of_handles_and_start_is_the_answer():
    mesh = bar()
    handles, moved = end_handles(mesh), mesh.vertices @ Q.T + [5.0, -2.0, 1.0]
    result = ArapSolver(mesh, 0.01).deform(handles, moved[handles], moved)
    assert_allclose(result.vertices, moved, atol=1e-9)
    assert_allclose(result.rotations, np.broadcast_to(Q, result.rotations.shape), atol=1e-7)
    assert result.energies.max() < 1e-9


@pytest.mark.parametrize("weight", [1.0, np.inf])
def test_turning_shifting_and_scaling_the_problem_does_so_to_the_answer(weight):
    mesh, solver = bar(), ArapSolver(bar(), 0.01)
    handles, targets = end_handles(mesh), bent(mesh.vertices)[end_handles(mesh)]

    def carry(points):
        return 1000.0 * points @ Q.T + [3e4, -2e4, 7e3]

    expected = carry(solver.deform(handles, targets, mesh.vertices, weight).vertices)
    both = ArapSolver(mesh.moved(carry(mesh.vertices)), 0.01).deform(handles, carry(targets), carry(mesh.vertices), weight)
    rest_stays = ArapSolver(mesh.moved(1000.0 * mesh.vertices), 0.01).deform(handles, carry(targets), carry(mesh.vertices), weight)
    assert_allclose(both.vertices, expected, atol=1e-4)
    assert_allclose(rest_stays.vertices, expected, atol=1e-4)


def test_hard_handles_are_met_and_soft_ones_the_better_the_heavier():
    mesh, solver = bar(), ArapSolver(bar(), 0.01)
    handles, targets = end_handles(mesh), bent(mesh.vertices)[end_handles(mesh)] + [0.0, 0.0, 1.0]
    missed = [
        np.abs(solver.deform(handles, targets, mesh.vertices, weight).vertices[handles] - targets).max() for weight in (0.01, 1.0, 100.0)
    ]
    assert missed[0] > missed[1] > missed[2] > 0
    hard = solver.deform(handles, targets, mesh.vertices, np.inf).vertices[handles]
    assert_allclose(hard, targets, atol=1e-12)
    mixed = np.where(np.arange(len(handles)) % 2, np.inf, 1.0)
    assert_allclose(solver.deform(handles, targets, mesh.vertices, mixed).vertices[handles][1::2], targets[1::2], atol=1e-12)


def test_a_component_without_handle_keeps_its_place_and_regains_its_shape():
    one, other = bar(), bar(10, 8)
    mesh = joined(one, TriangleMesh(other.vertices + [0, 3, 0], other.triangles))
    second = slice(len(one.vertices), None)
    moved = mesh.vertices[second] @ Q.T
    start = mesh.vertices.copy()
    start[second] = moved + 0.02 * np.random.default_rng(3).normal(size=moved.shape)
    result = ArapSolver(mesh, 0.0).deform(np.array([0]), one.vertices[:1] + 1.0, start, iterations=300).vertices
    assert_allclose(result[second].mean(axis=0), start[second].mean(axis=0), atol=1e-9)
    assert np.abs(result[second] - moved).max() < 0.3 * np.abs(start[second] - moved).max()
    assert_allclose(result[0], one.vertices[0] + 1.0, atol=1e-9)


def test_what_is_kept_moves_the_less_the_farther_from_the_handle():
    mesh, solver = bar(), ArapSolver(bar(), 0.01)
    start = bent(mesh.vertices)
    handle = np.array([np.argmax(mesh.vertices[:, 0])])
    target = start[handle] + [0.0, 0.0, 0.5]
    moved, loose = (solver.deform(handle, target, start, 10.0, 30, start_weight=keep).vertices - start for keep in (1.0, 0.0))
    near, far = np.abs(mesh.vertices[:, 0] - 2.0) < 0.5, mesh.vertices[:, 0] < 0
    assert np.abs(moved[far]).max() < 0.1 * np.abs(moved[near]).max()
    assert np.abs(loose[far]).max() > 5 * np.abs(moved[far]).max()
    energies = solver.deform(handle, target, start, 10.0, 30, start_weight=1.0).energies
    assert np.diff(energies).max() <= 1e-10 * energies[0]


def test_points_slide_in_their_planes_and_the_energy_still_falls():
    mesh, solver = bar(), ArapSolver(bar(), 0.01)
    lifted = mesh.vertices + [0.0, 0.0, 0.3]
    every = sparse.identity(len(mesh.vertices), format="csr")
    up = np.tile([0.0, 0.0, 1.0], (len(mesh.vertices), 1))
    aside = lifted + [0.7, 0.0, 0.0]  # only the height of these targets may count
    system = solver.system(Constraints.at_points(every, np.full(len(up), 2.0)))
    result = system.solve(Targets(aside, normals=up, plane_steps=5), Start(mesh.vertices), 30)
    assert_allclose(result.vertices, lifted, atol=1e-6)
    bumpy = aside + 0.1 * np.random.default_rng(7).normal(size=aside.shape)
    energies = system.solve(Targets(bumpy, normals=up, plane_steps=5), Start(mesh.vertices), 30).energies
    assert np.diff(energies).max() <= 1e-10 * energies[0]


def test_vertices_without_triangles_and_no_handles_at_all():
    mesh = TriangleMesh(np.vstack([bar().vertices, [[9.0, 9.0, 9.0]]]), bar().triangles)
    solver = ArapSolver(mesh, 0.01)
    nothing = solver.deform(np.array([], dtype=int), np.empty((0, 3)), mesh.vertices + 2.0)
    assert_allclose(nothing.vertices, mesh.vertices + 2.0, atol=1e-9)
    lone = len(mesh.vertices) - 1
    result = solver.deform(np.array([lone]), np.array([[1.0, 2.0, 3.0]]), mesh.vertices)
    assert_allclose(result.vertices[lone], [1.0, 2.0, 3.0], atol=1e-9)
    assert_allclose(result.vertices[:lone], mesh.vertices[:lone], atol=1e-9)


def test_needles_and_flat_triangles_do_not_spoil_the_shape():
    mesh = bar()
    vertices = mesh.vertices.copy()
    corner = mesh.triangles[100]
    vertices[corner[0]] = vertices[corner[1]] + 1e-9 * (vertices[corner[2]] - vertices[corner[1]])
    vertices[mesh.triangles[200, 0]] = vertices[mesh.triangles[200, 1:]].mean(axis=0)
    bad = mesh.moved(vertices)
    handles = end_handles(mesh)
    result = ArapSolver(bad, 0.01).deform(handles, bent(vertices)[handles], vertices, np.inf, 50).vertices
    clean = ArapSolver(mesh, 0.01).deform(handles, bent(mesh.vertices)[handles], mesh.vertices, np.inf, 50).vertices
    far = np.linalg.norm(mesh.vertices[:, None] - vertices[[corner[0], mesh.triangles[200, 0]]], axis=2).min(axis=1) > 0.8
    assert np.isfinite(result).all()
    assert np.abs(result - clean)[far].max() < 0.1 * mean_edge_length(mesh)


def test_other_handles_in_between_leave_no_trace():
    mesh, solver = bar(), ArapSolver(bar(), 0.01)
    handles, targets = end_handles(mesh), bent(mesh.vertices)[end_handles(mesh)]
    first = solver.deform(handles, targets, mesh.vertices).vertices
    solver.deform(handles[:3], targets[:3], mesh.vertices, weight=5.0)
    assert np.array_equal(solver.deform(handles, targets, mesh.vertices).vertices, first)
    assert np.array_equal(ArapSolver(mesh, 0.01).deform(handles, targets, mesh.vertices).vertices, first)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"handles": np.array([0, 0])}, "distinct"),
        ({"handles": np.array([0, 10**6])}, "handles must be from 0"),
        ({"handles": np.array([-1, 3])}, "handles must be from 0"),
        ({"targets": np.zeros((3, 3))}, r"targets must be \(2, 3\)"),
        ({"start": np.zeros((5, 3))}, "start must be"),
        ({"weight": 0.0}, "weight must be above 0"),
        ({"weight": np.nan}, "weight must be above 0"),
    ],
)
def test_refuses_what_does_not_fit(change, message):
    mesh = bar(8, 6)
    good = {"handles": np.array([0, 3]), "targets": np.zeros((2, 3)), "start": mesh.vertices, "weight": 1.0}
    with pytest.raises(ValueError, match=message):
        ArapSolver(mesh).deform(**(good | change))


def test_refuses_negative_smoothness():
    with pytest.raises(ValueError, match="smoothness must be 0 or more"):
        ArapSolver(bar(8, 6), -1.0)
