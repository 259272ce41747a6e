"""Intrinsic shape signature (ISS) key points: places where a surface has a shape of its own in all three directions.

Zhong, "Intrinsic shape signatures: a shape descriptor for 3D object recognition", ICCV Workshops 2009; the paper uses it
for the key points of reference mesh and frames.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from .geometry import TINY, vertex_areas
from .types import TriangleMesh

BLOCK_PAIRS = 1 << 21  # neighbour pairs held at once: bounds the memory to some 100 MB


@dataclass(frozen=True)
class KeypointSettings:
    """Radii are multiples of the length given to `find_keypoints`.

    salient : radius of the neighbourhood whose shape decides.
    suppression : radius in which only the most salient point stays.
    flatness : largest ratio of the second to the first and of the third to the second eigenvalue (0.975 published).
    least_neighbours : points with fewer neighbours are left out.
    """

    salient: float = 4.0
    suppression: float = 3.0
    flatness: float = 0.975
    least_neighbours: int = 5


def find_keypoints(mesh: TriangleMesh, length: float, settings: KeypointSettings = KeypointSettings()) -> np.ndarray:
    """Key points of a surface.

    mesh : coincident vertices merged.
    length : the unit of the radii, scene units: mean edge length or center spacing; the same for meshes to be compared.

    Returns (K,) int64 indices of vertices, ascending. Zhong weighs a point by one over its number of neighbours, which
    estimates the area it stands for; a mesh knows that area. Measured on remeshed bodies, areas repeat more key points.
    """
    if not length > 0:
        raise ValueError(f"length must be above 0; got {length}")
    if not len(mesh.vertices):
        return np.empty(0, dtype=np.int64)
    spectra, counts = scatter_spectra(mesh.vertices, vertex_areas(mesh), settings.salient * length)
    large, middle, small = spectra.T
    distinct = (middle < settings.flatness * large) & (small < settings.flatness * middle)
    eligible = np.flatnonzero(distinct & (counts > settings.least_neighbours))
    return eligible[_local_maxima(mesh.vertices[eligible], small[eligible], settings.suppression * length)]


def scatter_spectra(points: np.ndarray, weights: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues of the weighted scatter matrix of the neighbours of each of (N, 3) points, about the point itself.

    weights : (N,), at least 0, any unit.

    Returns the eigenvalues, largest first (N, 3), scene units squared, and the (N,) number of points in reach, the point itself included.
    """
    tree = cKDTree(points)
    counts = tree.query_ball_point(points, radius, return_length=True, workers=-1)
    centred = points - points.mean(axis=0)  # differences of squares keep their digits far from the origin
    squares = (centred[:, :, None] * centred[:, None, :]).reshape(-1, 9)
    moments = np.column_stack([np.ones(len(points)), centred, squares]) * weights[:, None]
    spectra = np.empty((len(points), 3))
    for rows, near in _neighbours(points, tree, radius, counts):
        total, first, second = np.split(near @ moments, [1, 4], axis=1)
        here = centred[rows]
        cross = first[:, :, None] * here[:, None, :]
        scatter = second.reshape(-1, 3, 3) - cross - cross.transpose(0, 2, 1) + total[:, :, None] * here[:, :, None] * here[:, None, :]
        spectra[rows] = np.linalg.eigvalsh(scatter / np.maximum(total[:, :, None], TINY))[:, ::-1]
    return spectra, counts


def _local_maxima(points: np.ndarray, values: np.ndarray, radius: float) -> np.ndarray:
    """(K,) indices of points that no point within the radius surpasses; of equals the first stays."""
    if not len(points):
        return np.empty(0, dtype=np.int64)
    rank = np.empty(len(points), dtype=np.int64)
    rank[np.lexsort((np.arange(len(points)), -values))] = np.arange(len(points))
    tree = cKDTree(points)
    counts = tree.query_ball_point(points, radius, return_length=True, workers=-1)
    best = np.empty(len(points), dtype=np.int64)
    for rows, near in _neighbours(points, tree, radius, counts):
        near = near.tocsr()
        best[rows] = np.minimum.reduceat(rank[near.indices], near.indptr[:-1])
    return np.flatnonzero(best == rank)


def _neighbours(points: np.ndarray, tree: cKDTree, radius: float, counts: np.ndarray) -> Iterator[tuple[np.ndarray, sparse.coo_matrix]]:
    """Rows and their 0/1 neighbour matrix, block by block; each row holds at least the point itself."""
    blocks = np.cumsum(counts) // BLOCK_PAIRS
    for rows in np.split(np.arange(len(points)), np.flatnonzero(np.diff(blocks)) + 1):
        pairs = cKDTree(points[rows]).sparse_distance_matrix(tree, radius, output_type="ndarray")
        yield rows, sparse.coo_matrix((np.ones(len(pairs)), (pairs["i"], pairs["j"])), shape=(len(rows), len(points)))
