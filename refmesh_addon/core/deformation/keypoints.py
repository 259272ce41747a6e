"""Intrinsic shape signature (ISS) key points: places where a surface has a shape of its own in all three directions.

Zhong, "Intrinsic shape signatures: a shape descriptor for 3D object recognition", ICCV Workshops 2009; the paper uses it
for the key points of reference mesh and frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..geometry.mesh import vertex_areas
from ..geometry.vectors import TINY
from ..types import TriangleMesh

BLOCK_PAIRS = 1 << 21  # neighbor pairs held at once: bounds the memory to some 100 MB
SAMPLED = 50  # every so many points tell how many pairs there are
NEAREST = 8  # neighbors that are asked first whether one of them is more salient
# Vertices of a mesh with edges of the unit of the radii have this area each, in squares of the unit. Above so many times as many, their
# pairs, which grow with the square, tell nothing more.
USUAL_AREA = np.sqrt(0.75)
DENSE = 4.0


@dataclass(frozen=True)
class KeypointSettings:
    """Radii are multiples of the length given to `find_keypoints`.

    salient : radius of the neighborhood whose shape decides.
    suppression : radius in which only the most salient point stays.
    flatness : largest ratio of the second to the first and of the third to the second eigenvalue (0.975 published).
    least_neighbors : points with fewer neighbors are left out.
    variation : least surface variation (Pauly et al. 2002), the smallest eigenvalue over the sum of the three: 0 on a plane, at most 1/3.
    """

    salient: float = 4.0
    suppression: float = 3.0
    flatness: float = 0.975
    least_neighbors: int = 5
    variation: float = 0.0


# For the paper's search among all key points of a frame, which a surface without features of its own misleads: around any two points
# of a ball or of a flat face the patches fit. A surface of this variation is as round as a ball about as large as a patch.
PUBLISHED_KEYPOINTS = KeypointSettings(variation=0.02)


def find_keypoints(mesh: TriangleMesh, length: float, settings: KeypointSettings = KeypointSettings()) -> np.ndarray:
    """Key points of a surface.

    mesh : coincident vertices merged.
    length : the unit of the radii, scene units: mean edge length or center spacing; the same for meshes to be compared.

    Returns (K,) int64 indices of vertices, ascending. Zhong weighs a point by one over its number of neighbors, which
    estimates the area it stands for; a mesh knows that area. Measured on remeshed bodies, areas repeat more key points.
    Raises ValueError for a length that is not above 0.
    """
    if not length > 0:
        raise ValueError(f"length must be above 0; got {length}")
    if not len(mesh.vertices):
        return np.empty(0, dtype=np.int64)
    chosen, areas = _thinned(mesh, length)
    points = mesh.vertices[chosen]
    spectra, counts = scatter_spectra(points, areas, settings.salient * length)
    large, middle, small = spectra.T
    distinct = (middle < settings.flatness * large) & (small < settings.flatness * middle)
    featured = np.maximum(small, 0.0) >= settings.variation * spectra.sum(axis=1)  # rounding leaves planes a little below zero
    eligible = np.flatnonzero(distinct & featured & (counts > settings.least_neighbors))
    return chosen[eligible[_local_maxima(points[eligible], small[eligible], settings.suppression * length)]]


def _thinned(mesh: TriangleMesh, length: float) -> tuple[np.ndarray, np.ndarray]:
    """(N,) ascending indices of the vertices to look at, and the areas that they stand for: all, or of a dense mesh one in each cell of a
    grid, the one nearest to the middle of what the cell holds.
    """
    areas, vertices = vertex_areas(mesh), mesh.vertices
    if len(areas) <= DENSE * areas.sum() / (USUAL_AREA * length**2):
        return np.arange(len(areas)), areas
    cells = np.unique(np.floor((vertices - vertices.min(axis=0)) / length).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    weights = np.maximum(areas, TINY)
    total = np.bincount(cells, weights)
    middles = np.column_stack([np.bincount(cells, weights * column) for column in vertices.T]) / total[:, None]
    order = np.lexsort((np.linalg.norm(vertices - middles[cells], axis=1), cells))
    firsts = order[np.flatnonzero(np.diff(cells[order], prepend=-1))]
    return np.sort(firsts), total[cells[np.sort(firsts)]]


def scatter_spectra(points: np.ndarray, weights: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues of the weighted scatter matrix of the neighbors of each of (N, 3) points, about the point itself.

    weights : (N,), at least 0, any unit.

    Returns the eigenvalues, largest first (N, 3), scene units squared, and the (N,) number of points in reach, the point itself included.
    """
    centered = points - points.mean(axis=0)  # differences of squares keep their digits far from the origin
    squares = (centered[:, :, None] * centered[:, None, :]).reshape(-1, 9)
    moments = np.column_stack([np.ones(len(points)), centered, squares]) * weights[:, None]
    sums = _ball_sums(centered, np.column_stack([np.ones(len(points)), moments]), radius)
    counts, total, first, second = np.split(sums, [1, 2, 5], axis=1)
    cross = first[:, :, None] * centered[:, None, :]
    scatter = second.reshape(-1, 3, 3) - cross - cross.transpose(0, 2, 1) + total[:, :, None] * centered[:, :, None] * centered[:, None, :]
    return np.linalg.eigvalsh(scatter / np.maximum(total[:, :, None], TINY))[:, ::-1], np.rint(counts[:, 0]).astype(np.int64)


def _ball_sums(points: np.ndarray, values: np.ndarray, radius: float) -> np.ndarray:
    """(N, k) sums of the (N, k) values over all points in reach of each of (N, 3), slab by slab along the longest side."""
    along = points[:, np.ptp(points, axis=0).argmax()]
    order = np.argsort(along, kind="stable")
    some = points[order[::SAMPLED]]
    pairs = 0.5 * len(points) * np.mean(cKDTree(points).query_ball_point(some, radius, return_length=True))
    result = np.empty(values.shape)
    for core in np.array_split(order, max(1, round(pairs / BLOCK_PAIRS))):
        ends = along[core[0]] - radius, along[core[-1]] + radius
        slab = order[slice(np.searchsorted(along[order], ends[0]), np.searchsorted(along[order], ends[1], side="right"))]
        i, j = cKDTree(points[slab]).query_pairs(radius, output_type="ndarray").T
        near = sparse.coo_matrix((np.ones(len(i)), (i, j)), shape=(len(slab),) * 2)
        sums = np.empty(values.shape)
        sums[slab] = values[slab] + near @ values[slab] + near.T @ values[slab]
        result[core] = sums[core]
    return result


def _local_maxima(points: np.ndarray, values: np.ndarray, radius: float) -> np.ndarray:
    """(K,) indices of points that no point within the radius surpasses; of equals the first stays."""
    if not len(points):
        return np.empty(0, dtype=np.int64)
    rank = np.empty(len(points), dtype=np.int64)
    rank[np.lexsort((np.arange(len(points)), -values))] = np.arange(len(points))
    tree = cKDTree(points)
    # Most are surpassed by one of the few nearest, and only the rest need all that are in reach.
    distance, near = tree.query(points, k=np.arange(1, min(NEAREST, len(points)) + 1), workers=-1)
    first = np.where(distance <= radius, rank[near], len(points)).min(axis=1)
    high = np.flatnonzero(first == rank)
    reach = tree.query_ball_point(points[high], radius, workers=-1)
    return high[[rank[near].min() == rank[own] for own, near in zip(high, reach)]]
