"""Alignment of mapped frames with the anchor frame (paper, equations (5) and (6)).

The paper moves each frame's reference centers so that the IoU of the mapped frame and the mapped anchor frame grows. IoU
of voxels has no gradient to follow, so a point-to-plane pull of one surface onto the other proposes how the centers
move, as rigidly as possible along the affinity graph, and the IoU decides whether a step is kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from .closest_point import SurfaceIndex
from .geometry import triangle_normals, vertex_normals
from .mapping import FrameMap, closed_apart
from .types import TriangleMesh, _FrozenArrays
from .voxels import Grid, fill, grid_around

GATE = 1.0  # farthest partner of a surface point, in s
COMPATIBLE = 0.6  # least cosine between the normals of partners
# Weight of the affinity graph's smoothness against one surface point per center, at the first and the last step: large parts
# move as one before small ones follow, or single centers run to the wrong side of a fold of cloth (Amberg et al. 2007).
STIFFEST, SOFTEST = 10.0, 0.3
STRONGEST = 8  # kin of a center that its move is compared with
DAMPING = 1e-3  # keeps centers that no surface point speaks for where they are
MOST_POINTS = 20  # surface points per center that take part in one step
IOU_RESOLUTION = 128  # voxels along the longest side when overlap is measured: the paper's 0.01 at 1.8 units, nearly
STEP_SHARES = (1.0, 0.5, 0.25)  # damped steps tried before one is refused


@dataclass(frozen=True)
class Alignment(_FrozenArrays):
    """targets : (C, 3) the frame's own reference centers X'_f.  before, after : IoU with the anchor frame."""

    targets: np.ndarray
    before: float
    after: float


@dataclass(frozen=True)
class AnchorFrame:
    """The mapped anchor frame, ready to be aligned with."""

    index: SurfaceIndex
    normals: np.ndarray
    grid: Grid
    inside: np.ndarray

    @classmethod
    def of(cls, mesh: TriangleMesh, whole: np.ndarray) -> AnchorFrame:
        """mesh : mapped anchor frame.  whole : (T,) bool, its triangles that do not span a tear."""
        surface = TriangleMesh(mesh.vertices, mesh.triangles[whole])
        grid = grid_around(mesh.vertices, IOU_RESOLUTION)
        return cls(SurfaceIndex(surface), triangle_normals(surface), grid, fill(closed_apart(mesh, whole), grid))

    def iou(self, mesh: TriangleMesh) -> float:
        """Of the volumes of a mapped frame and this one, also where the frame leaves the anchor frame's box."""
        corners = (mesh.vertices - self.grid.origin) / self.grid.spacing
        low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
        inside = fill(mesh, Grid(self.grid.origin + low * self.grid.spacing, self.grid.spacing, tuple(np.maximum(high - low, 1))))
        start = np.maximum(low, 0)
        end = np.maximum(np.minimum(high, self.grid.shape), start)
        common, own = (tuple(map(slice, start - corner, end - corner)) for corner in (low, 0))
        shared = np.count_nonzero(inside[common] & self.inside[own])
        joint = np.count_nonzero(inside) + np.count_nonzero(self.inside) - shared
        return shared / joint if joint else 1.0


def align(frame: FrameMap, targets: np.ndarray, anchor: AnchorFrame, steps: int) -> Alignment:
    """Moves a frame's reference centers so that its mapped mesh covers the anchor frame's volume better.

    targets : (C, 3) reference centers to start from.  steps : at most.
    The IoU never falls: a step that would lower it is damped, then refused.
    """
    mesh = frame.to(targets)
    best = before = anchor.iou(frame.closed(mesh))
    for rigidity in np.geomspace(STIFFEST, SOFTEST, steps):
        move = _pull(mesh, frame, anchor, rigidity)
        for share in STEP_SHARES:
            candidate = frame.to(targets + share * move)
            score = anchor.iou(frame.closed(candidate))
            if score > best:
                targets, mesh, best = targets + share * move, candidate, score
                break
    return Alignment(targets, before, best)


def _pull(mesh: TriangleMesh, frame: FrameMap, anchor: AnchorFrame, rigidity: float) -> np.ndarray:
    """(C, 3) moves of the centers that bring surface points onto the tangent planes of their partners."""
    weights = frame.binding.weights
    stride = max(1, len(mesh.vertices) // (MOST_POINTS * weights.shape[1]))
    chosen = np.arange(0, len(mesh.vertices), stride)
    points, own = mesh.vertices[chosen], vertex_normals(mesh)[chosen]
    partner = anchor.index.query(points, max_distance=GATE * frame.spacing)
    found = np.flatnonzero(partner.triangles >= 0)
    normals = anchor.normals[partner.triangles[found]]
    found = found[np.einsum("ij,ij->i", normals, own[found]) > COMPATIBLE]
    normals = anchor.normals[partner.triangles[found]]
    gap = np.einsum("ij,ij->i", normals, partner.points[found] - points[found])
    return _moved_centers(weights[chosen[found]], normals, gap, frame.affinity, rigidity)


def _moved_centers(weights, normals, gap, affinity, rigidity: float) -> np.ndarray:
    """Least squares: n . (W d) = gap for each point, |d_i - d_j|^2 small along the affinity graph."""
    count = weights.shape[1]
    rows = sparse.hstack([weights.multiply(normals[:, [k]]) for k in range(3)]).tocsr()
    per_center = len(gap) / count
    laplacian = sparse.csgraph.laplacian(_graph(affinity))
    smooth = sparse.block_diag([laplacian] * 3) * (rigidity * per_center)
    system = rows.T @ rows + smooth + sparse.identity(3 * count) * (DAMPING * max(per_center, 1.0))
    solved = splu(sparse.csc_matrix(system)).solve(rows.T @ gap)
    return solved.reshape(3, count).T


def _graph(affinity: sparse.csr_matrix) -> sparse.csr_matrix:
    """Each center with its STRONGEST kin, symmetric, without the diagonal: few enough for a sparse factorisation."""
    pairs = sparse.coo_matrix(affinity - sparse.diags(affinity.diagonal()))
    order = np.lexsort((pairs.col, -pairs.data, pairs.row))
    rank = np.arange(pairs.nnz) - np.searchsorted(pairs.row[order], pairs.row[order])
    kept = order[rank < STRONGEST]
    graph = sparse.csr_matrix((pairs.data[kept] / STRONGEST, (pairs.row[kept], pairs.col[kept])), pairs.shape)
    return graph.maximum(graph.T)
