"""Screened Poisson surface reconstruction: the solid whose boundary oriented points lie on.

Kazhdan & Hoppe, "Screened Poisson surface reconstruction", ACM TOG 2013: the function f that minimizes
integral |grad f - V|^2 + (alpha / h) * sum a_p f(p)^2, where V sums the inward normals, each times the area a_p that its point
represents; f is about 1/2 inside and -1/2 outside. As there, it is solved from coarse to fine, at each level only near the points; here
with trilinear elements on the cells of a regular grid. Unlike there, the levels also follow the zero set of the coarser solution, so that
the finest level contains the whole surface.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, cg

from .sparse_grid import CORNERS, NEIGHBORS, SparseGrid, whole_grid

SCREENING = 4.0  # alpha, the published weight of the points against the gradients
COARSEST = 16  # cells along the longest side at the coarsest level, which covers the whole box
MARGIN = 3  # cells of the coarsest level around the points
REACH = 2  # cells around the points that a level has
TOLERANCE = 1e-4  # relative residual at which conjugate gradients stop
MOST_STEPS = 500  # of conjugate gradients; a level takes some dozens
OUTSIDE = -0.5  # value of the function far from the points
_MASS, _STIFFNESS = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6, np.array([[1.0, -1.0], [-1.0, 1.0]])
_DERIVATIVE = np.array([[-0.5, -0.5], [0.5, 0.5]])  # integral of phi_i' phi_j


def solve_screened_poisson(points: np.ndarray, normals: np.ndarray, cell: float) -> tuple[SparseGrid, np.ndarray]:
    """A grid around the zero set, and the values of the function at its (N,) nodes, positive inside.

    points : (P, 3) scene units.  normals : (P, 3) outward, unit length.  cell : side of the finest cells, scene units.
    """
    levels = max(0, int(np.ceil(np.log2(np.ptp(points, axis=0).max() / (COARSEST * cell)))))
    grid = _coarsest(points, cell * 2**levels)
    values = _solved(grid, np.full(len(grid.nodes), OUTSIDE), points, normals)
    for _ in range(levels):
        coarse, coarse_values = grid, values
        grid = _refined(coarse, coarse_values, points)
        values = _solved(grid, coarse.prolonged(coarse_values, grid), points, normals)
    return grid, values


def _coarsest(points: np.ndarray, cell: float) -> SparseGrid:
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    inner = np.maximum(1, np.ceil(extent / cell).astype(int))
    origin = low - ((inner + 2 * MARGIN) * cell - extent) / 2
    x, y, z = (int(count) for count in inner + 2 * MARGIN)
    return whole_grid(origin, cell, (x, y, z))


def _refined(grid: SparseGrid, values: np.ndarray, points: np.ndarray) -> SparseGrid:
    inside = (values > 0)[grid.corners]
    crossed = grid.cells[inside.any(axis=1) & ~inside.all(axis=1)]
    empty = grid.refined(grid.cells[:0])
    near_points = empty.dilated(np.unique(empty.cells_of(points)[0]), REACH)
    parents = np.unique(grid.keys(empty.coordinates(near_points) // 2))
    needed = np.union1d(parents, grid.dilated(crossed))
    return grid.refined(np.intersect1d(needed, grid.cells, assume_unique=True))


def _solved(grid: SparseGrid, start: np.ndarray, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(N,) values of least energy. Nodes at the boundary of the grid, with fewer than eight cells around them, keep those of `start`."""
    at_points = grid.interpolation(points)
    area = _areas(grid, at_points)
    weight = SCREENING / grid.cell * area
    gradients = -(at_points.T @ (area[:, None] * normals)) / grid.cell**3
    free = np.flatnonzero(np.bincount(grid.corners.ravel(), minlength=len(start)) == 8)
    stiffness = _stiffness(grid, free)
    right = _divergence(grid, gradients)[free] - stiffness @ start - (at_points.T @ (weight * (at_points @ start)))[free]
    inner, at_points = stiffness[:, free], at_points[:, free]
    from_points = at_points.T.tocsr()
    diagonal = inner.diagonal() + from_points.power(2) @ weight
    matrix = LinearOperator(inner.shape, matvec=lambda values: inner @ values + from_points @ (weight * (at_points @ values)))
    precondition = LinearOperator(inner.shape, matvec=lambda residual: residual / diagonal)
    values = start.copy()
    values[free] += cg(matrix, right, rtol=TOLERANCE, maxiter=MOST_STEPS, M=precondition)[0]
    return values


def _areas(grid: SparseGrid, at_points: sparse.csr_matrix) -> np.ndarray:
    """(P,) area that each point represents, scene units squared, from the density of the points around it.

    Spread to the nodes and interpolated back, the points of a plane add up to about 2/3 of their number per square of a cell.
    """
    density = at_points @ np.asarray(at_points.sum(axis=0)).ravel()
    return 2 / 3 * grid.cell**2 / density


def _stiffness(grid: SparseGrid, free: np.ndarray) -> sparse.csr_matrix:
    """(len(free), N) stiffness matrix, rows of free nodes only: these have all eight cells around them, and so the same stencil."""
    element = grid.cell * np.sum([_tensor(axis, _STIFFNESS) for axis in range(3)], axis=0)
    stencil = np.zeros(len(NEIGHBORS))
    for one in range(8):
        for other in range(8):
            stencil[(CORNERS[other] - CORNERS[one] + 1) @ [9, 3, 1]] += element[one, other]
    columns = np.searchsorted(grid.nodes, grid.nodes[free][:, None] + NEIGHBORS @ grid.strides)
    starts = np.arange(0, columns.size + 1, len(NEIGHBORS))
    return sparse.csr_matrix((np.tile(stencil, len(free)), columns.ravel(), starts), shape=(len(free), len(grid.nodes)))


def _divergence(grid: SparseGrid, gradients: np.ndarray) -> np.ndarray:
    """(N,) integrals of V times the gradient of each node's basis function, for the trilinear V with (N, 3) values."""
    parts = sum(gradients[grid.corners, axis] @ _tensor(axis, _DERIVATIVE).T for axis in range(3))
    return grid.cell**2 * np.bincount(grid.corners.ravel(), parts.ravel(), minlength=len(grid.nodes))


def _tensor(axis: int, factor: np.ndarray) -> np.ndarray:
    """(8, 8) element matrix: the tensor product of `factor` along one axis and the mass matrix along the others."""
    factors = [factor if axis == other else _MASS for other in range(3)]
    return np.kron(np.kron(factors[2], factors[1]), factors[0])
