"""The enclosed volume as weighted points, coarse to fine: what centers are spread through.

Filling decides at the full resolution what is inside; Lloyd's integrals do not need every voxel. Blocks of voxels with
their exact mass and centroid serve as well: with some hundred blocks per center the pull differs from the one over
all voxels by far less than a voxel, at a small part of the cost.

The grid is turned against the axes of the scene. Floors, walls and boxes lie along these, and a whole face would gain or lose a layer of
voxels at once where it passes their centers: centers then slide to and fro behind it, and end up elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ..geometry.voxels import fill, grid_around, grid_of
from ..types import FrozenArrays, TriangleMesh

SAMPLES_PER_CENTER = (8, 32, 200)  # blocks per center on each level, at least, coarse to fine
# Rotation vector of the grid, radians. Steps of a tilted face average out over it; the boxes around turned bodies are hardly larger.
TURN = (0.126, -0.222, 0.159)


@dataclass(frozen=True)
class VolumeSamples(FrozenArrays):
    """positions : (N, 3) centroids of the filled part of each block, scene units.
    masses : (N,) float64, filled voxels in the block.  spacing : edge of a block, scene units.
    """

    positions: Annotated[np.ndarray, "(N, 3) float64"]
    masses: Annotated[np.ndarray, "(N) float64"]
    spacing: float

    def where(self, chosen: np.ndarray) -> VolumeSamples:
        """Those marked in (N,) bool `chosen`."""
        return VolumeSamples(self.positions[chosen], self.masses[chosen], self.spacing)

    @cached_property
    def moments(self) -> np.ndarray:
        """(N, 4) mass, and mass times position, of each sample."""
        return np.column_stack([self.masses, self.masses[:, None] * self.positions])

    @cached_property
    def tree(self) -> cKDTree:
        """Of the positions: it takes longer to build than a step of tracking, and is needed only where a center owns nothing."""
        return cKDTree(self.positions)


@dataclass(frozen=True)
class Volume:
    """levels : coarse to fine samples of the same volume.  voxel : edge of a voxel.  size : enclosed volume, cubed units.
    is_view : whether it is what a camera sees of a body, so that it ends where the view does.
    """

    levels: tuple[VolumeSamples, ...]
    voxel: float
    size: float
    is_view: bool = False

    @property
    def finest(self) -> VolumeSamples:
        """The finest samples of the volume."""
        return self.levels[-1]

    def center_spacing(self, count: int) -> float:
        """s = (enclosed volume / C)^(1/3), the unit of every tracking length."""
        return float((self.size / count) ** (1 / 3))


def sample_volume(mesh: TriangleMesh, resolution: int, count: int) -> Volume:
    """The volume of one frame for `count` centers.

    mesh : closed, or its holes are capped.  resolution : voxels along the longest side.
    Raises ValueError when fewer voxels are inside than there are centers.

    >>> volume = sample_volume(ball, resolution=32, count=50)
    >>> round(volume.center_spacing(50), 2)
    0.44
    """
    turn, middle = Rotation.from_rotvec(TURN).as_matrix(), mesh.vertices.mean(axis=0)
    turned = mesh.moved((mesh.vertices - middle) @ turn)
    grid = grid_of(turned.vertices, grid_around(mesh.vertices, resolution).spacing)
    inside = fill(turned, grid)
    filled = int(np.count_nonzero(inside))
    if filled < count:
        raise ValueError(f"only {filled} voxels lie inside at resolution {resolution}, too few for {count} centers")
    *coarse, finest = (_block_edge(filled, samples * count) for samples in SAMPLES_PER_CENTER)
    blocks = [_voxel_blocks(inside, finest)]
    for edge in dict.fromkeys(finest * max(1, edge // finest) for edge in reversed(coarse)):
        if edge > finest:
            blocks.append(_joined(blocks[0], edge // finest))
    placed = lambda centroids: (grid.origin + (centroids + 0.5) * grid.spacing) @ turn.T + middle
    levels = (VolumeSamples(placed(b.centroids), b.masses, grid.spacing * b.edge) for b in reversed(blocks))
    return Volume(tuple(levels), grid.spacing, filled * grid.spacing**3)


def _block_edge(filled: int, count: int) -> int:
    """Voxels along a block's edge so that at least `count` blocks hold the `filled` voxels, where there are as many."""
    return max(1, int((filled / count) ** (1 / 3)))


@dataclass(frozen=True)
class _Blocks:
    """places : (N, 3) which blocks of the grid hold anything.  masses : (N,) voxels.  centroids : (N, 3) in voxels.  edge : in voxels."""

    places: np.ndarray
    masses: np.ndarray
    centroids: np.ndarray
    edge: int


def _voxel_blocks(inside: np.ndarray, edge: int) -> _Blocks:
    """The filled voxels of a grid in blocks, one slab of blocks at a time, by lines across the slab: voxels are too many to list."""
    slabs = []
    for start in range(0, inside.shape[0], edge):
        counts, offsets = _along_slab(inside[start : start + edge])
        y, z = np.nonzero(counts)
        masses = counts[y, z].astype(np.float64)
        moments = np.stack([start * masses + offsets[y, z], masses * y, masses * z], axis=1)
        slabs.append(_gathered(moments, masses, np.stack([np.full(len(y), start // edge), y // edge, z // edge], axis=1)))
    places, masses, centroids = (np.concatenate(arrays) for arrays in zip(*slabs, strict=True))
    return _Blocks(places, masses, centroids, edge)


def _along_slab(slab: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number of filled voxels in each line (Y, Z) across a slab (X, Y, Z), and the sum of their indices along the line.

    Running sums from the far end: the voxel at index k is counted k times.
    """
    counts, offsets = (np.zeros(slab.shape[1:], dtype=np.int32) for _ in range(2))
    for row in slab[:0:-1]:
        counts += row
        offsets += counts
    return counts + slab[0], offsets


def _joined(blocks: _Blocks, factor: int) -> _Blocks:
    """Blocks whose edge is `factor` times as long."""
    moments = blocks.masses[:, None] * blocks.centroids
    return _Blocks(*_gathered(moments, blocks.masses, blocks.places // factor), blocks.edge * factor)


def _gathered(moments: np.ndarray, masses: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distinct places (N, 3) in ascending order, with the total mass (N,) and the centroid (N, 3) at each.

    moments : (M, 3) mass times position.  masses : (M,).  places : (M, 3) int, some of them equal.
    """
    if not len(masses):
        return places, masses, moments
    low = places.min(axis=0)
    shape = places.max(axis=0) + 1 - low
    number = np.ravel_multi_index((places - low).T, shape)
    total = np.bincount(number, masses, np.prod(shape))
    filled = np.flatnonzero(total)
    sums = np.stack([np.bincount(number, axis, len(total))[filled] for axis in moments.T], axis=1)
    return np.stack(np.unravel_index(filled, shape), axis=1) + low, total[filled], sums / total[filled, None]
