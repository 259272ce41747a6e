"""Connected components of a graph."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph


def connected_components(edges: np.ndarray, count: int) -> tuple[int, np.ndarray]:
    """Number of components of a graph with `count` nodes and the (count,) label of each node.

    edges : (E, 2) int, undirected, repeated ones allowed. A node without edges is a component of its own. Labels ascend with the lowest
    node of each component.
    """
    graph = sparse.coo_matrix((np.ones(len(edges)), tuple(edges.T)), shape=(count, count))
    return csgraph.connected_components(graph, directed=False)
