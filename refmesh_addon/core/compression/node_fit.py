"""Control nodes for a moving mesh: where they are and how they move. Only an encoder needs this."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from ..geometry.rotations import rigid_motions
from .skinning import NEIGHBORS

SLACK = 1.25  # of the reach over the distance that just suffices


def spread_nodes(lengths: sparse.csr_matrix, count: int) -> np.ndarray:
    """(J,) vertices, coarse to fine: one in each component, the largest first, then each the farthest along edges from those before.

    lengths : (V, V) sparse lengths of the edges.  count : greatest J.
    """
    _, component = csgraph.connected_components(lengths, directed=False)
    largest = np.argsort(-np.bincount(component), kind="stable")[:count]
    nodes = np.unique(component, return_index=True)[1][largest].tolist()
    distances = csgraph.dijkstra(lengths, indices=nodes, min_only=True)
    distances[np.isinf(distances)] = 0.0  # of components without a node
    while len(nodes) < count and distances.max() > 0:  # each round adds a node
        nodes.append(int(np.argmax(distances)))
        new = csgraph.dijkstra(lengths, indices=nodes[-1], limit=float(distances.max()))
        distances = np.minimum(distances, new)
    return np.array(nodes, dtype=np.int64)


def reach_of(lengths: sparse.csr_matrix, nodes: np.ndarray) -> float:
    """Distance along edges within which all vertices have the nodes that move them, as far as their component has as many.

    lengths : (V, V) of the edges, grid units.  nodes : (J,) vertices.
    """
    distances = csgraph.dijkstra(lengths, indices=nodes, min_only=True)
    spacing = float(distances[np.isfinite(distances)].max())
    return np.ceil(SLACK * (NEIGHBORS - 1) * max(spacing, 1.0))


def fitted_motion(weights: sparse.csr_matrix, rest: np.ndarray, frames: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(F, J, 3, 3) rotations and (F, J, 3) shifts that carry each node's surroundings from rest to each frame (Kabsch 1976).

    weights : (V, J) sparse.  rest : (V, 3).  frames : (F, V, 3).  nodes : (J,) vertices.
    """
    rotations, shifts = [], []
    for frame in frames:
        motions = rigid_motions(weights.T, rest, frame)
        rotations.append(motions.rotations)
        shifts.append(motions.apply(rest[nodes]) - rest[nodes])
    return np.stack(rotations), np.stack(shifts)
