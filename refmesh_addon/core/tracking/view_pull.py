"""The pull of the volume on centers where a camera sees part of a body only, so that the border of the view moves over it.

Lloyd's pull spreads centers evenly through what is seen. As a body turns, surface leaves the view at one border and enters it at another,
and centers even that out by sliding over the body. Here only the volume near a center pulls on it, and beside a border hardly anything
pulls across it: a center there goes where the rigid motion of its neighborhood carries it. A little of the pull remains, because a border
may also be the end of a body, such as a sheet of paper that is moved in its own plane.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..geometry.rotations import rigid_motions
from ..geometry.vectors import normalized, row_dot
from .lloyd import sums_by_owner
from .ownership import Ownership
from .rigidity import Rigidity
from .volume import VolumeSamples

REACH = 0.9  # distance, in s, from which on volume does not pull: beyond most cells of centers that are spread evenly
AROUND = 1.5  # radius, in s, of the volume by which a center is judged to be beside a border
# Distance from a center to the centroid of the volume around it, across the sheet left out, in that radius: up to this inside of the view,
# from the second on at its border. A half disk has 0.42, the voxels of a whole one 0.02.
INSIDE, BESIDE = 0.05, 0.2
KEPT = 0.1  # share of the pull across a border that remains


class ViewPull:
    """Where centers should go, on one level of a volume.  around : samples of any level, to judge by where borders are."""

    def __init__(self, rigidity: Rigidity, ownership: Ownership, around: VolumeSamples, spacing: float):
        self._rigidity, self._ownership, self._around, self._spacing = rigidity, ownership, around, spacing
        self._borders: np.ndarray | None = None

    def goals(self, centers: np.ndarray) -> np.ndarray:
        """(C, 3) centroids of the near parts of the cells of (C, 3) centers, or rigid predictions where a border would decide."""
        if self._borders is None:  # centers go a part of their spacing on a level, so that these change little
            self._borders = border_directions(centers, self._around, self._spacing)
        rigidity = self._rigidity
        carried = rigid_motions(rigidity.weights, rigidity.old, centers).apply(rigidity.old)
        masses, centroids = near_cells(centers, self._ownership, REACH * self._spacing)
        pulled = np.where(masses[:, None] > 0, centroids, carried)
        return pulled + row_dot(carried - pulled, self._borders)[:, None] * self._borders


def near_cells(centers: np.ndarray, ownership: Ownership, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """(C,) masses and (C, 3) centroids of the cells of (C, 3) centers up to a distance; zeros where there is none."""
    owners, samples = ownership.of(centers), ownership.samples
    near = np.flatnonzero(row_dot(offsets := samples.positions - centers[owners], offsets) < reach**2)
    sums = sums_by_owner(owners[near], samples.moments[near], len(centers))
    return sums[:, 0], sums[:, 1:] / np.maximum(sums[:, :1], 1)


def border_directions(centers: np.ndarray, samples: VolumeSamples, spacing: float) -> np.ndarray:
    """(C, 3) away from the border that a center is beside, along the sheet; squared length 0 inside of the view to 1 - KEPT at a border."""
    radius = AROUND * spacing
    pairs = cKDTree(centers).sparse_distance_matrix(samples.tree, radius, output_type="coo_matrix")
    near = sparse.csr_matrix((np.ones(len(pairs.row)), (pairs.row, pairs.col)), (len(centers), len(samples.positions)))
    middle = centers.mean(axis=0)
    places = samples.positions - middle
    products = (places[:, :, None] * places[:, None, :]).reshape(-1, 9)
    sums = near @ (samples.masses[:, None] * np.column_stack([np.ones(len(places)), places, products]))
    masses = np.maximum(sums[:, :1], np.finfo(float).tiny)
    centroids, second = sums[:, 1:4] / masses, (sums[:, 4:] / masses).reshape(-1, 3, 3)
    across = np.linalg.eigh(second - centroids[:, :, None] * centroids[:, None, :])[1][:, :, 0]  # the sheet is thinnest across
    offsets = centroids - (centers - middle)
    offsets = np.where(sums[:, :1] > 0, offsets - row_dot(offsets, across)[:, None] * across, 0.0)
    beside = np.clip((np.linalg.norm(offsets, axis=1) / radius - INSIDE) / (BESIDE - INSIDE), 0.0, 1.0 - KEPT)
    return np.sqrt(beside)[:, None] * normalized(offsets)
