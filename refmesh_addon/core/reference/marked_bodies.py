"""Bodies that touch in every frame, told apart by marks of the user, since no motion shows that they are two.

The marks are seeds in a graph of neighboring centers. Harmonic values between the seeds of two bodies order the centers (as in
Grady 2006, "Random walks for image segmentation"), and of all cuts in that order the narrowest is taken, relative to what it
cuts off: least crossing weight over the smaller volume to the power of two thirds, as area scales with volume. Without affinity
across the cut, the bodies are separated in the reference positions like those that part by themselves.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph
from scipy.sparse.linalg import LinearOperator, cg
from scipy.spatial import cKDTree

from ..tracking.neighbors import NEAR, lasting_pairs
from .marks import Marks

REACH = 2.0  # center spacings between a mark and its center, at most
TOLERANCE = 1e-8  # relative residual of the harmonic values, of which only the order matters


def bodies_by_marks(positions: np.ndarray, numbers: Sequence[int], spacing: float, marks: Marks | None) -> np.ndarray | None:
    """The bodies of `marked_bodies` from marks in one of the frames; None without marks, or where their frame is not among the numbers.

    positions : (F, C, 3) scene units.  numbers : of the frames.  spacing : s, scene units.  Raises ValueError as `marked_centers` does.
    """
    if marks is None or marks.frame not in numbers:
        return None
    seeds = marked_centers(positions[list(numbers).index(marks.frame)], spacing, marks.bodies)
    return marked_bodies(positions, spacing, seeds)


def marked_centers(centers: np.ndarray, spacing: float, bodies: Sequence[np.ndarray]) -> list[np.ndarray]:
    """The centers nearest to marks, as indices for each body.

    centers : (C, 3) in the frame of the marks.  bodies : (N, 3) points of each.
    Raises ValueError for a point far from all centers and for a center that two bodies claim.
    """
    tree, seeds = cKDTree(centers), []
    for points in bodies:
        distance, nearest = tree.query(points)
        if distance.max() > REACH * spacing:
            raise ValueError(f"the point {_formatted(points[np.argmax(distance)])} lies outside the volume")
        seeds.append(np.unique(nearest))
    claimed, claims = np.unique(np.concatenate(seeds), return_counts=True)
    if claims.max() > 1:
        raise ValueError(f"two bodies are marked at {_formatted(centers[claimed[np.argmax(claims)]])}")
    return seeds


def marked_bodies(positions: np.ndarray, spacing: float, seeds: Sequence[np.ndarray]) -> np.ndarray:
    """(C,) number of the body that each center belongs to; -1 where no chain of lasting neighbors leads to a marked center.

    positions : (F, C, 3) scene units.  spacing : s, scene units.  seeds : center indices of each body, no center in two of them.
    """
    count = positions.shape[1]
    pairs, farthest = lasting_pairs(positions, spacing)
    weights = 0.5 ** ((farthest / (NEAR * spacing)) ** 2)
    graph = sparse.coo_matrix((weights, (pairs[:, 0], pairs[:, 1])), (count, count)).tocsr()
    seeded = np.full(count, -1)
    for body, centers in enumerate(seeds):
        seeded[centers] = body
    return _divided(graph + graph.T, seeded)


def _divided(graph: sparse.csr_matrix, seeded: np.ndarray) -> np.ndarray:
    """(C,) bodies of a graph with some known nodes, (C,) or -1: cut in two where two bodies are connected, then each piece again."""
    result = seeded.copy()
    pieces = [np.arange(len(seeded))]
    while pieces:  # each cut leaves a piece with one body less
        nodes = pieces.pop()
        count, label = csgraph.connected_components(graph[nodes][:, nodes], directed=False)
        for piece in (nodes[label == number] for number in range(count)):
            known = np.unique(seeded[piece[seeded[piece] >= 0]])
            if len(known) > 1:
                first = _narrowest_cut(graph[piece][:, piece], seeded[piece] == known[0], np.isin(seeded[piece], known[1:]))
                result[piece[first]] = known[0]
                pieces.append(piece[~first])
            elif len(known):
                result[piece] = known[0]
    return result


def _narrowest_cut(graph: sparse.csr_matrix, own: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(N,) bool, the side of `own` of the narrowest cut between two sets of nodes, each (N,) bool."""
    count = graph.shape[0]
    free = np.flatnonzero(~(own | others))
    value = own.astype(float)
    if len(free):
        laplacian = csgraph.laplacian(graph).tocsr()[free]
        value[free] = _solved(laplacian[:, free], -laplacian @ value)
    order = np.concatenate([np.flatnonzero(own), free[np.argsort(-value[free], kind="stable")], np.flatnonzero(others)])
    rank = np.argsort(order)
    pairs = sparse.triu(graph).tocoo()
    ends = np.sort([rank[pairs.row], rank[pairs.col]], axis=0)
    crossing = np.cumsum(np.bincount(ends[0], pairs.data, count) - np.bincount(ends[1], pairs.data, count))
    sizes = np.arange(own.sum(), count - others.sum() + 1)  # of the side of `own`, for each cut
    narrowest = sizes[np.argmin(crossing[sizes - 1] / np.minimum(sizes, count - sizes) ** (2 / 3))]
    return rank < narrowest


def _solved(matrix: sparse.csr_matrix, right: np.ndarray) -> np.ndarray:
    """Solution of a symmetric positive definite system by conjugate gradients: a factor of a volumetric graph would be nearly dense."""
    diagonal = matrix.diagonal()
    return cg(matrix, right, rtol=TOLERANCE, M=LinearOperator(matrix.shape, matvec=lambda values: values.ravel() / diagonal))[0]


def _formatted(point: np.ndarray) -> str:
    return "({:.4g}, {:.4g}, {:.4g})".format(*point)
