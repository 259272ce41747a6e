"""The energy of as-rigid-as-possible deformation with smooth rotations (Levi & Gotsman 2015; the paper, deformation re-meshing).

Of positions p' and one rotation R_i for each vertex, against the rest positions p:

    sum over i, j in N(i):  w_ij |(p'_i - p'_j) - R_i (p_i - p_j)|^2  +  alpha A |R_i - R_j|^2
    + sum over constraints: weight_k |b_k p' - target_k|^2            (soft; fixed vertices are met exactly; with a normal n_k only
                                                                       the distance along it counts: point to plane)
    + sum over vertices: start_weight_i |p'_i - start_i|^2            (pull toward the start; see `ArapSystem`)

w are cotangent weights, A is the surface area and alpha the smoothness: both terms are areas, so the balance does not
depend on the scale, and since |R_i - R_j|^2 shrinks like the squared edge length while the number of edges grows, it
does not depend on the number of triangles either. On the boundary of an open mesh the second term counts half.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from ..geometry.cotangent import cotangent_weights, spokes, triangle_adjacency
from ..geometry.mesh import triangle_areas, vertex_components
from ..geometry.vectors import row_dot
from ..types import TriangleMesh
from .smooth_rotations import SmoothRotations


@dataclass(frozen=True)
class RestShape:
    """Rest positions in the forms that the two steps need.

    covariance : (3 R, R) sparse, `spokes`: takes positions to covariance sums.  right_side : (R, 3 R) sparse, its transpose: takes
    rotations to the right side of the global step.  size : sum of w_ij |p_i - p_j|^2, scene units squared.
    """

    covariance: sparse.csr_matrix
    right_side: sparse.csr_matrix
    size: float


class ArapEnergy:
    """The terms that do not depend on constraints, built once for a mesh.

    mesh : the rest shape; several components and vertices without triangles are allowed.
    smoothness : alpha, no unit, 0 for plain as-rigid-as-possible.
    Raises ValueError for a negative smoothness.
    """

    def __init__(self, mesh: TriangleMesh, smoothness: float):
        if not smoothness >= 0:
            raise ValueError(f"smoothness must be 0 or more; got {smoothness}")
        self.mesh, self.smoothness, self.area = mesh, smoothness, float(triangle_areas(mesh).sum())
        self.weights = cotangent_weights(mesh)
        self.laplacian = (sparse.diags(np.asarray(self.weights.sum(axis=1)).ravel()) - self.weights).tocsr()
        self.adjacency = triangle_adjacency(mesh)
        self.smooth_rotations = SmoothRotations(self.adjacency, smoothness * self.area, self._spread())
        self.component_count, self.components = vertex_components(mesh)

    @cached_property
    def rest(self) -> RestShape:
        """Of the mesh itself."""
        return self.rest_shape(self.mesh.vertices)

    def rest_shape(self, positions: np.ndarray) -> RestShape:
        """For (R, 3) rest positions other than those of the mesh; the weights stay those of the mesh."""
        centered = positions - positions.mean(axis=0)
        covariance = spokes(self.weights, centered)
        return RestShape(covariance, covariance.T.tocsr(), 2.0 * float(np.vdot(centered, self.laplacian @ centered)))

    def of(self, positions: np.ndarray, transposed: np.ndarray, covariance: np.ndarray, rest: RestShape) -> float:
        """The first two sums, scene units squared.

        positions : (R, 3).  transposed : (R, 9) transposes of the rotations, row-major.  covariance : (R, 9), of these positions.
        """
        size = 2.0 * np.vdot(positions, self.laplacian @ positions)
        rigid = size + rest.size - 2.0 * np.vdot(transposed, covariance)
        return rigid + self.smooth_rotations.energy(transposed)

    def _spread(self) -> np.ndarray:
        """(R,) sums of w_ij |p_i - p_j|^2 over the neighbors of each vertex."""
        centered = self.mesh.vertices - self.mesh.vertices.mean(axis=0)
        return 2.0 * row_dot(centered, self.laplacian @ centered) - self.laplacian @ row_dot(centered, centered)
