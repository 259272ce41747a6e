"""The published tracking schedule, written plainly: what our tracker's speed is measured against.

Every step asks every interior voxel for its nearest center, moves the centers by a fixed mean of the two pulls, and goes on
until the largest move is below the published threshold (Dvorak et al. 2022 and 2023). The query uses all cores.
Lengths of the affinity are our own, so that both trackers relate the same centers.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from refmesh_addon.core.geometry.voxels import fill, grid_around
from refmesh_addon.core.tracking.affinity import DISAGREEMENT_HALF, MIN_AFFINITY, SEPARATION_HALF
from refmesh_addon.core.types import TriangleMesh

PRESMOOTHING_STEPS = 10
LLOYD_WEIGHT, ARAP_WEIGHT = 1.0, 2.0  # of the two pulls in a step
MOST_STEPS = 1000
STOP = 1e-4 / 1.8  # published for bodies 1.8 units tall; as a share of the height


@dataclass(frozen=True)
class Motions:
    """For each of C centers, x -> rotation (x - source) + target."""

    rotations: np.ndarray
    sources: np.ndarray
    targets: np.ndarray

    def apply(self, points: np.ndarray) -> np.ndarray:
        return np.einsum("nij,nj->ni", self.rotations, points - self.sources) + self.targets


@dataclass(frozen=True)
class Cells:
    """The voxels nearest to each center.

    owner : (N,) center of each voxel.  masses : (C,) voxels.  centroids : (C, 3).  energy : mean squared distance to the owner.
    """

    owner: np.ndarray
    masses: np.ndarray
    centroids: np.ndarray
    energy: float

    def second_moments(self, voxels: np.ndarray) -> np.ndarray:
        """(C, 3, 3) mean outer products about the centroids."""
        offset = voxels - self.centroids[self.owner]
        sums = [np.bincount(self.owner, offset[:, i] * offset[:, j], len(self.masses)) for i in range(3) for j in range(3)]
        return np.stack(sums, axis=1).reshape(-1, 3, 3) / np.maximum(self.masses, 1)[:, None, None]


class MaxAffinity:
    """Largest separation and largest disagreement of motion of every pair of centers so far, dense (C, C), in s^2."""

    def __init__(self, centers: np.ndarray, spacing: float):
        self.spacing = spacing
        self.separation = self._squared_distances(centers)
        self.disagreement = np.zeros_like(self.separation)

    def weights(self) -> np.ndarray:
        """(C, C) affinities, those below MIN_AFFINITY dropped."""
        value = 0.5 ** (self.separation / SEPARATION_HALF**2 + self.disagreement / DISAGREEMENT_HALF**2)
        return np.where(value < MIN_AFFINITY, 0.0, value)

    def update(self, centers: np.ndarray, cells: Cells, voxels: np.ndarray, motions: Motions) -> None:
        """centers : in the new frame.  cells, voxels : of the frame before.  motions : from there to the new frame."""
        self.separation = np.maximum(self.separation, self._squared_distances(centers))
        i, j = np.nonzero(self.weights())
        turn = motions.rotations[i] - motions.rotations[j]
        offset = motions.targets - np.einsum("nij,nj->ni", motions.rotations, motions.sources)
        apart = np.einsum("nij,nj->ni", turn, cells.centroids[i]) + offset[i] - offset[j]
        spread = np.einsum("nij,njk,nik->n", turn, cells.second_moments(voxels)[i], turn)
        one_sided = np.zeros_like(self.disagreement)
        one_sided[i, j] = ((apart**2).sum(axis=1) + spread) / self.spacing**2
        self.disagreement = np.maximum(self.disagreement, (one_sided + one_sided.T) / 2)

    def _squared_distances(self, centers: np.ndarray) -> np.ndarray:
        return ((centers[:, None] - centers[None]) ** 2).sum(axis=2) / self.spacing**2


@dataclass
class PublishedFrame:
    """Where the centers ended in one frame, the seconds that took, and (seconds, energy in s^2) before each step on the way."""

    centers: np.ndarray
    finished: bool = True
    seconds: float = 0.0
    trace: list[tuple[float, float]] = field(default_factory=list)

    def seconds_to(self, energy: float) -> float | None:
        """When the energy was first this low; None where it never was."""
        return next((when for when, value in self.trace if value <= energy), None)


def interior_voxels(mesh: TriangleMesh, resolution: int) -> np.ndarray:
    """Middles (N, 3) of all voxels inside."""
    grid = grid_around(mesh.vertices, resolution)
    return grid.positions(fill(mesh, grid))


def track(meshes: list[TriangleMesh], resolution: int, start: np.ndarray, limit: float) -> list[PublishedFrame]:
    """Tracks the (C, 3) centers `start` of the first mesh through the others.

    limit : seconds after which it gives up; the frame at work is then the last one, not finished.
    """
    height, began = np.ptp(meshes[0].vertices, axis=0).max(), time.perf_counter()
    last = interior_voxels(meshes[0], resolution)
    affinity = MaxAffinity(start, center_spacing(meshes[0], resolution, len(start)))
    frames, before = [PublishedFrame(start)], start
    for mesh in meshes[1:]:
        old, frame_began = frames[-1].centers, time.perf_counter()
        voxels, weights = interior_voxels(mesh, resolution), affinity.weights()
        frame = _settled(2 * old - before, old, weights, voxels, STOP * height, began + limit)
        affinity.update(frame.centers, cells(old, last), last, best_motions(weights, old, frame.centers))
        frame.seconds = time.perf_counter() - frame_began
        frame.trace = [(when - frame_began, energy / affinity.spacing**2) for when, energy in frame.trace]
        frames.append(frame)
        if not frame.finished:
            break
        before, last = old, voxels
    return frames


def _settled(centers, old, weights, voxels, stop: float, deadline: float) -> PublishedFrame:
    for _ in range(PRESMOOTHING_STEPS):
        centers = best_motions(weights, old, centers).apply(old)
    frame = PublishedFrame(centers)
    for _ in range(MOST_STEPS):
        owned = cells(frame.centers, voxels)
        to_rigid = best_motions(weights, old, frame.centers).apply(old) - frame.centers
        move = (LLOYD_WEIGHT * (owned.centroids - frame.centers) + ARAP_WEIGHT * to_rigid) / (LLOYD_WEIGHT + ARAP_WEIGHT)
        frame.trace.append((time.perf_counter(), owned.energy + _mean_square(to_rigid)))
        frame.centers = frame.centers + move
        if np.linalg.norm(move, axis=1).max() < stop:
            return frame
        if time.perf_counter() > deadline:
            frame.finished = False
            return frame
    return frame


def cells(centers: np.ndarray, voxels: np.ndarray) -> Cells:
    """A center that owns no voxel has the nearest one as centroid."""
    distance, owner = cKDTree(centers).query(voxels, workers=-1)
    masses = np.bincount(owner, minlength=len(centers))
    sums = np.stack([np.bincount(owner, voxels[:, k], len(centers)) for k in range(3)], axis=1)
    centroids = sums / np.maximum(masses, 1)[:, None]
    for empty in np.flatnonzero(masses == 0):
        centroids[empty] = voxels[((voxels - centers[empty]) ** 2).sum(axis=1).argmin()]
    return Cells(owner, masses, centroids, _mean_square(distance[:, None]))


def best_motions(weights: np.ndarray, source: np.ndarray, target: np.ndarray) -> Motions:
    """Best rigid motion of each neighborhood (Kabsch 1976), by singular value decomposition.

    weights : (C, C).  source, target : (C, 3).
    """
    share = weights / weights.sum(axis=1, keepdims=True)
    sources, targets = share @ source, share @ target
    products = (target[:, :, None] * source[:, None, :]).reshape(-1, 9)
    u, _, vt = np.linalg.svd((share @ products).reshape(-1, 3, 3) - targets[:, :, None] * sources[:, None, :])
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return Motions(u @ vt, sources, targets)


def center_spacing(mesh: TriangleMesh, resolution: int, count: int) -> float:
    """s = (enclosed volume / C)^(1/3), scene units."""
    grid = grid_around(mesh.vertices, resolution)
    return float((np.count_nonzero(fill(mesh, grid)) / count) ** (1 / 3) * grid.spacing)


def energies(trajectory: list[np.ndarray], meshes: list[TriangleMesh], resolution: int) -> list[tuple[float, float]]:
    """(Lloyd, ARAP) energy in s^2 of any tracker's (C, 3) centers in each frame, over all voxels; the judge of both trackers."""
    spacing = center_spacing(meshes[0], resolution, len(trajectory[0]))
    affinity, result = MaxAffinity(trajectory[0], spacing), []
    old_cells = old_voxels = None
    for index, (centers, mesh) in enumerate(zip(trajectory, meshes)):
        voxels = interior_voxels(mesh, resolution)
        owned, arap = cells(centers, voxels), 0.0
        if index:
            old = trajectory[index - 1]
            motions = best_motions(affinity.weights(), old, centers)
            arap = _mean_square(motions.apply(old) - centers)
            affinity.update(centers, old_cells, old_voxels, motions)
        result.append((owned.energy / spacing**2, arap / spacing**2))
        old_cells, old_voxels = owned, voxels
    return result


def _mean_square(vectors: np.ndarray) -> float:
    return float((vectors**2).sum() / len(vectors))
