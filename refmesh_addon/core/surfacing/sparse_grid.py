"""Sparse grids: the cells of a regular grid near a surface, and functions that are trilinear in each of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

# Corner k of a cell: bits 0, 1 and 2 of k are its coordinates along x, y and z.
CORNERS = np.array([[corner & 1, corner >> 1 & 1, corner >> 2] for corner in range(8)])
NEIGHBORS = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True)
class SparseGrid:
    """Some cells of a grid of cubes, and the nodes at their corners.

    origin : (3,) position of node (0, 0, 0), scene units.  cell : side of a cell, scene units.  shape : cells of the whole grid.
    cells : (M,) sorted keys of the cells that it has; a key numbers the nodes (x, y, z) of the whole grid, z fastest.
    """

    origin: np.ndarray
    cell: float
    shape: tuple[int, int, int]
    cells: np.ndarray

    @cached_property
    def strides(self) -> np.ndarray:
        """(3,) difference between the keys of neighbors along each axis."""
        return np.array([(self.shape[1] + 1) * (self.shape[2] + 1), self.shape[2] + 1, 1])

    @cached_property
    def nodes(self) -> np.ndarray:
        """(N,) sorted keys of the corners of all cells."""
        return np.unique(self.cells[:, None] + CORNERS @ self.strides)

    @cached_property
    def corners(self) -> np.ndarray:
        """(M, 8) indices into `nodes` of each cell's corners, in the order of CORNERS."""
        return np.searchsorted(self.nodes, self.cells[:, None] + CORNERS @ self.strides).astype(np.int32)

    def coordinates(self, keys: np.ndarray) -> np.ndarray:
        """(K, 3) integer coordinates of keys."""
        return np.column_stack([keys // self.strides[0], keys // self.strides[1] % (self.shape[1] + 1), keys % self.strides[1]])

    def keys(self, coordinates: np.ndarray) -> np.ndarray:
        """Keys of (K, 3) integer coordinates."""
        return coordinates @ self.strides

    def cells_of(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Keys of the cells that hold (P, 3) points within the whole grid, and the (P, 3) local coordinates in them, 0 to 1."""
        scaled = (points - self.origin) / self.cell
        cell = np.clip(np.floor(scaled).astype(np.int64), 0, np.array(self.shape) - 1)
        return self.keys(cell), scaled - cell

    def interpolation(self, points: np.ndarray) -> sparse.csr_matrix:
        """(P, N) matrix that maps values at the nodes to those of the trilinear function at (P, 3) points.

        Raises ValueError for points outside the cells.
        """
        keys, local = self.cells_of(points)
        owners = np.minimum(np.searchsorted(self.cells, keys), len(self.cells) - 1)
        if not np.array_equal(self.cells[owners], keys):
            raise ValueError("points must lie in cells of the grid")
        weights = _corner_weights(local)
        starts = np.arange(0, 8 * len(points) + 1, 8)
        return sparse.csr_matrix((weights.ravel(), self.corners[owners].ravel(), starts), shape=(len(points), len(self.nodes)))

    def value_and_gradient(self, values: np.ndarray, cells: np.ndarray, local: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(P,) values and (P, 3) gradients, per cell, of the trilinear function with (N,) values at the nodes.

        cells : (P,) indices of cells.  local : (P, 3) coordinates in them, 0 to 1.
        """
        corners = values[self.corners[cells]].reshape(-1, 2, 2, 2)  # z, y, x
        x, y, z = (local[:, axis, None, None] for axis in range(3))
        along_x = corners[:, :, :, 0] + x * (corners[:, :, :, 1] - corners[:, :, :, 0])
        along_y = along_x[:, :, 0] + y[:, 0] * (along_x[:, :, 1] - along_x[:, :, 0])
        gradient_x = _bilinear(corners[:, :, :, 1] - corners[:, :, :, 0], z, y)
        gradient_y = (along_x[:, 0, 1] - along_x[:, 0, 0]) * (1 - z[:, 0, 0]) + (along_x[:, 1, 1] - along_x[:, 1, 0]) * z[:, 0, 0]
        gradient_z = along_y[:, 1] - along_y[:, 0]
        value = along_y[:, 0] + z[:, 0, 0] * gradient_z
        return value, np.column_stack([gradient_x, gradient_y, gradient_z])

    def dilated(self, keys: np.ndarray, steps: int = 1) -> np.ndarray:
        """Sorted keys of the cells of the whole grid within some steps of the given ones, diagonal steps included."""
        for _ in range(steps):
            around = (self.coordinates(keys)[:, None] + NEIGHBORS).reshape(-1, 3)
            keys = np.unique(self.keys(around[((around >= 0) & (around < self.shape)).all(axis=1)]))
        return keys

    def refined(self, cells: np.ndarray) -> SparseGrid:
        """The grid of the children of the given cells, of half the size."""
        x, y, z = self.shape
        fine = SparseGrid(self.origin, self.cell / 2, (2 * x, 2 * y, 2 * z), np.zeros(0, dtype=np.int64))
        children = np.unique(fine.keys((2 * self.coordinates(cells)[:, None] + CORNERS).reshape(-1, 3)))
        return SparseGrid(fine.origin, fine.cell, fine.shape, children)

    def prolonged(self, values: np.ndarray, fine: SparseGrid) -> np.ndarray:
        """Values at the nodes of a refined grid of the trilinear function with (N,) values at the nodes of this one."""
        coordinates = fine.coordinates(fine.cells)
        parents = np.searchsorted(self.cells, self.keys(coordinates // 2))
        child = coordinates % 2 @ [1, 2, 4]
        result = np.empty(len(fine.nodes))
        for number, corner in enumerate(CORNERS):
            chosen = child == number
            weights = _corner_weights((corner + CORNERS) / 2)  # of the corners of the parent at those of this child
            result[fine.corners[chosen]] = values[self.corners[parents[chosen]]] @ weights.T
        return result


def _bilinear(corners: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(K,) bilinear interpolation of (K, 2, 2) corners by (K, 1, 1) coordinates along both axes."""
    blended = corners[:, 0] + first[:, 0] * (corners[:, 1] - corners[:, 0])
    return blended[:, 0] + second[:, 0, 0] * (blended[:, 1] - blended[:, 0])


def _corner_weights(local: np.ndarray) -> np.ndarray:
    """(K, 8) trilinear weights of the corners of a cell at (K, 3) local coordinates, 0 to 1."""
    x, y, z = (np.stack([1 - local[:, axis], local[:, axis]], axis=1) for axis in range(3))
    return (z[:, :, None, None] * y[:, None, :, None] * x[:, None, None, :]).reshape(-1, 8)


def whole_grid(origin: np.ndarray, cell: float, shape: tuple[int, int, int]) -> SparseGrid:
    """A grid with all its cells."""
    empty = SparseGrid(origin, cell, shape, np.zeros(0, dtype=np.int64))
    coordinates = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 3)
    return SparseGrid(origin, cell, shape, empty.keys(coordinates))
