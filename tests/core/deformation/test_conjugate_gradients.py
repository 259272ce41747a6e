"""Conjugate gradients beside a dense solution."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from refmesh_addon.core.deformation.conjugate_gradients import conjugate_gradients

COUNT = 12


def problem():
    """A dense matrix that couples the three axes, a preconditioner near it, and a right side."""
    rng = np.random.default_rng(0)
    root = rng.normal(size=(3 * COUNT, 3 * COUNT))
    matrix = root @ root.T + 10.0 * np.eye(3 * COUNT)
    times = lambda table: lambda x: (table @ x.ravel()).reshape(-1, 3)
    return matrix, times(matrix), times(np.diag(1.0 / np.diag(matrix))), rng.normal(size=(COUNT, 3))


def test_enough_steps_solve_the_system():
    matrix, product, precondition, right_side = problem()
    start = np.random.default_rng(1).normal(size=(COUNT, 3))
    x = conjugate_gradients(product, precondition, start, right_side - product(start), 3 * COUNT)
    assert_allclose(x.ravel(), np.linalg.solve(matrix, right_side.ravel()), atol=1e-9)


def test_the_exact_preconditioner_needs_one_step():
    matrix, product, _, right_side = problem()
    inverse = lambda x: np.linalg.solve(matrix, x.ravel()).reshape(-1, 3)
    x = conjugate_gradients(product, inverse, np.zeros((COUNT, 3)), right_side, 1)
    assert_allclose(product(x), right_side, atol=1e-12)


def test_each_step_lowers_the_energy():
    _, product, precondition, right_side = problem()
    energy = lambda x: 0.5 * np.vdot(x, product(x)) - np.vdot(x, right_side)
    energies = [energy(conjugate_gradients(product, precondition, np.zeros((COUNT, 3)), right_side, steps)) for steps in range(8)]
    assert (np.diff(energies) < 0).all()


def test_the_solution_stays():
    _, product, precondition, _ = problem()
    start = np.ones((COUNT, 3))
    assert_array_equal(conjugate_gradients(product, precondition, start, np.zeros((COUNT, 3)), 5), start)
