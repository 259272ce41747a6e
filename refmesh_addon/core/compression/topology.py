"""What triangles alone tell of a mesh, to an encoder and to a decoder."""

from __future__ import annotations

import numpy as np

from .hierarchy import neighbors, vertex_hierarchy
from .interpolation import stencil


class Topology:
    """Levels of vertices and the equations that predict each from coarser ones.

    triangles : (T, 3) int64.  count : of vertices.  adjacency : (V, V) sparse, ones between neighbors.
    coarsest : (C,) vertices that nothing predicts.  levels, stencils : coarse to fine.
    """

    def __init__(self, triangles: np.ndarray, count: int):
        hierarchy = vertex_hierarchy(triangles, count)
        self.triangles, self.count = triangles, count
        self.coarsest, self.levels = hierarchy.coarsest, hierarchy.levels
        self.stencils = [stencil(level) for level in self.levels]
        self.adjacency = self.levels[-1].adjacency if self.levels else neighbors(triangles, count)
