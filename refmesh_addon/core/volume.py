"""The enclosed volume as weighted points, coarse to fine: what centers are spread through.

Filling decides at the full resolution what is inside; Lloyd's integrals do not need every voxel. Blocks of voxels that
keep their exact mass and centroid serve as well: with some hundred blocks per center the pull differs from the one over
all voxels by far less than a voxel, at a small part of the cost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .types import TriangleMesh, _FrozenArrays
from .voxels import Grid, fill, grid_around

SAMPLES_PER_CENTER = (8, 32, 200)  # blocks wanted per center on each level, coarse to fine


@dataclass(frozen=True)
class VolumeSamples(_FrozenArrays):
    """positions : (N, 3) centroids of the filled part of each block, scene units.
    masses : (N,) float64, filled voxels in the block.  spacing : edge of a block, scene units.
    """

    positions: np.ndarray
    masses: np.ndarray
    spacing: float


@dataclass(frozen=True)
class Volume:
    """levels : coarse to fine samples of the same volume.  voxel : edge of a voxel.  size : enclosed volume, cubed units."""

    levels: tuple[VolumeSamples, ...]
    voxel: float
    size: float

    @property
    def finest(self) -> VolumeSamples:
        return self.levels[-1]

    def center_spacing(self, count: int) -> float:
        """s = (enclosed volume / C)^(1/3), the unit of every tracking length."""
        return float((self.size / count) ** (1 / 3))


def sample_volume(mesh: TriangleMesh, resolution: int, count: int) -> Volume:
    """The volume of one frame for `count` centers.

    Raises ValueError when no voxel is inside, or fewer than there are centers.
    """
    grid = grid_around(mesh.vertices, resolution)
    inside = fill(mesh, grid)
    filled = int(np.count_nonzero(inside))
    if filled < count:
        raise ValueError(f"only {filled} voxels lie inside at resolution {resolution}, too few for {count} centers")
    factors = [_block_factor(filled, wanted * count) for wanted in SAMPLES_PER_CENTER]
    levels = tuple(_blocks(inside, grid, factor) for factor in sorted(set(factors), reverse=True))
    return Volume(levels, grid.spacing, filled * grid.spacing**3)


def _block_factor(filled: int, wanted: int) -> int:
    """Voxels along a block's edge so that at least `wanted` blocks hold the volume, where there are as many voxels."""
    return max(1, int((filled / wanted) ** (1 / 3)))


def _blocks(inside: np.ndarray, grid: Grid, factor: int) -> VolumeSamples:
    if factor == 1:
        positions = grid.positions(inside)
        return VolumeSamples(positions, np.ones(len(positions)), grid.spacing)
    found = [_slab_blocks(inside[start : start + factor], start, factor) for start in range(0, inside.shape[0], factor)]
    masses = np.concatenate([mass for mass, _ in found])
    centroids = np.concatenate([centroid for _, centroid in found])
    return VolumeSamples(grid.origin + (centroids + 0.5) * grid.spacing, masses, grid.spacing * factor)


def _slab_blocks(slab: np.ndarray, start: int, factor: int) -> tuple[np.ndarray, np.ndarray]:
    """Masses (N,) and centroids (N, 3) in cell indices of the filled blocks of a slab one block thick."""
    padding = [(0, -size % factor) for size in slab.shape]
    cells = np.pad(slab, padding).astype(np.float32)
    rows, columns = cells.shape[1] // factor, cells.shape[2] // factor
    cells = cells.reshape(factor, rows, factor, columns, factor)
    inner = np.arange(factor, dtype=np.float32)
    sums = cells @ np.stack([np.ones(factor, np.float32), inner], axis=1)  # mass and first z moment of each run of cells
    plane = sums[..., 0].sum(axis=0)
    mass = plane.sum(axis=1)
    moment = np.stack(
        [
            np.einsum("i,iajb->ab", inner, sums[..., 0]),
            np.einsum("j,ajb->ab", inner, plane),
            sums[..., 1].sum(axis=(0, 2)),
        ],
        axis=-1,
    )
    row, column = np.nonzero(mass)
    mass = mass[row, column].astype(np.float64)
    corner = np.stack([np.full(len(row), start), row * factor, column * factor], axis=1)
    return mass, corner + moment[row, column] / mass[:, None]
