"""Motion of control nodes blended over a mesh, in integers: embedded deformation.

Sumner, Schmid & Pauly, "Embedded deformation for shape manipulation", SIGGRAPH 2007, with distances along the edges in place of
straight ones, so that a hand on the hip does not move with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from ..types import FrozenArrays

NEIGHBORS = 4  # nodes that move a vertex
WEIGHT_BITS, ROTATION_BITS = 12, 14  # binary digits of weights and of rotation matrices
SCALE = float(1 << (WEIGHT_BITS + ROTATION_BITS))  # of blended motions
LONGEST = 1 << 40  # distance to a node out of reach, grid units
_BLOCK = 1 << 21  # distances held at a time


@dataclass(frozen=True)
class NodeMotion(FrozenArrays):
    """Rigid motion of J nodes in F frames: x -> rotation (x - node) + node + shift.

    rotations : (F, J, 3, 3) integers, in 2^-ROTATION_BITS.  shifts : (F, J, 3) integers, grid units.
    """

    rotations: np.ndarray
    shifts: np.ndarray

    def of(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """(J, 3, 3) rotations and (J, 3) shifts of one frame."""
        return self.rotations[frame], self.shifts[frame]


def edge_lengths(adjacency: sparse.csr_matrix, points: np.ndarray) -> sparse.csr_matrix:
    """(V, V) whole lengths of the edges, at least 1.  points : (V, 3) integers, grid units."""
    rows = np.repeat(np.arange(len(points)), np.diff(adjacency.indptr))
    difference = points[rows] - points[adjacency.indices]
    square = difference[:, 0] ** 2 + difference[:, 1] ** 2 + difference[:, 2] ** 2
    lengths = np.maximum(np.floor(np.sqrt(square)), 1.0)
    return sparse.csr_matrix((lengths, adjacency.indices, adjacency.indptr), shape=adjacency.shape)


def node_weights(lengths: sparse.csr_matrix, nodes: np.ndarray, reach: float) -> sparse.csr_matrix:
    """(V, J) integers, each row with the sum 2^WEIGHT_BITS, at most NEIGHBORS of them above 0.

    nodes : (J,) vertices.  reach : grid units along edges, within which every vertex has its nodes; one out of reach of all
    moves with the first node.
    """
    near, which = _nearest_nodes(lengths, nodes, reach)
    limit = np.maximum(near[:, NEIGHBORS], near[:, 0] + 1.0)
    share = (1.0 - np.minimum(near[:, :NEIGHBORS] / limit[:, None], 1.0)) ** 2
    share[:, 0] = np.maximum(share[:, 0], 2.0**-WEIGHT_BITS)
    total = ((share[:, 0] + share[:, 1]) + share[:, 2]) + share[:, 3]
    weights = np.floor((1 << WEIGHT_BITS) * share / total[:, None])
    weights[:, 0] += (1 << WEIGHT_BITS) - weights.sum(axis=1)
    rows = np.repeat(np.arange(len(near)), NEIGHBORS)
    result = sparse.csr_matrix((weights.ravel(), (rows, which[:, :NEIGHBORS].ravel())), shape=(len(near), len(nodes)))
    result.eliminate_zeros()
    return result


def _nearest_nodes(lengths: sparse.csr_matrix, nodes: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """(V, NEIGHBORS + 1) distances to the nearest nodes, ascending, and which they are; ties go to the lower number."""
    count, kept = lengths.shape[0], NEIGHBORS + 1
    near = np.full((count, kept), float(LONGEST))
    which = np.zeros((count, kept), dtype=np.int64)
    block = max(1, _BLOCK // max(count, 1))
    for start in range(0, len(nodes), block):
        some = nodes[start : start + block]
        distances = csgraph.dijkstra(lengths, indices=some, limit=reach).T
        every = np.hstack([near, np.minimum(distances, LONGEST)])
        owners = np.hstack([which, np.broadcast_to(np.arange(start, start + len(some)), distances.shape)])
        order = np.argsort(every, axis=1, kind="stable")[:, :kept]
        near, which = np.take_along_axis(every, order, axis=1), np.take_along_axis(owners, order, axis=1)
    return near, which


def blended(weights: sparse.csr_matrix, places: np.ndarray, motion: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """(V, 3, 4) integers, in 2^-(WEIGHT_BITS + ROTATION_BITS): the affine motion of each vertex in one frame.

    places : (J, 3) integers, the nodes at rest, grid units.  motion : (J, 3, 3) rotations and (J, 3) shifts.
    """
    rotations, shifts = motion
    turned = rotations[..., 0] * places[:, :1]
    turned += rotations[..., 1] * places[:, 1:2]
    turned += rotations[..., 2] * places[:, 2:]
    offsets = (places + shifts) * float(1 << ROTATION_BITS) - turned
    maps = np.concatenate([rotations, offsets[..., None]], axis=-1)
    return (weights @ maps.reshape(-1, 12)).reshape(-1, 3, 4)


def moved(maps: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(V, 3) integers: points at rest, grid units, carried by `blended` maps."""
    carried = maps[..., 3] + maps[..., 0] * points[:, :1]
    carried += maps[..., 1] * points[:, 1:2]
    carried += maps[..., 2] * points[:, 2:]
    return np.floor(carried / SCALE + 0.5)


def at_rest(maps: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(V, 3) what `moved` carries to (V, 3) points, but for rounding; only an encoder needs it."""
    return np.linalg.solve(maps[..., :3] / SCALE, (points - maps[..., 3] / SCALE)[..., None])[..., 0]
