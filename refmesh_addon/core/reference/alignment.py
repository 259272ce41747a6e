"""Alignment of mapped frames with the anchor frame (paper, equations (5) and (6)).

The paper moves each frame's reference centers so that the IoU of the mapped frame and the mapped anchor frame grows. IoU
of voxels has no gradient to follow, so a point-to-plane pull of one surface onto the other proposes how the centers
move, as rigidly as possible along the affinity graph, and the IoU decides whether a step is kept. What is finer than the
centers, the wrinkles of cloth, is then moved along its normals.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, cg
from scipy.spatial import cKDTree

from ..geometry.mesh import sample_surface, triangle_normals, vertex_normals
from ..geometry.vectors import row_dot
from ..geometry.voxels import Grid, fill, grid_around
from ..types import FrozenArrays, TriangleMesh
from .detail import moved_along_normals
from .mapping import FrameMap, closed_apart

GATE = 1.0  # farthest partner of a surface point, in s
COMPATIBLE = 0.6  # least cosine between the normals of partners
# Weight of the affinity graph's smoothness against one surface point per center, at the first and the last step: large parts
# move as one before small ones follow, or single centers run to the wrong side of a fold of cloth (Amberg et al. 2007).
STIFFEST, SOFTEST = 10.0, 0.3
STRONGEST = 8  # kin of a center that its move is compared with
DAMPING = 1e-3  # keeps centers that no surface point speaks for where they are
DENSE_POINTS = 60  # points per center on the anchor frame's surface: about 0.1 s apart on a body of 1000 centers
MOST_POINTS = 12  # surface points per center that take part in one step
TOLERANCE = 1e-3  # of a step's solution, far below what the next step changes
IOU_RESOLUTION = 128  # voxels along the longest side when overlap is measured: the paper's 0.01 at 1.8 units, nearly
STEP_SHARES = (1.0, 0.5, 0.25)  # damped steps tried before one is refused
DETAIL = 0.25  # extent of the detail that the centers are too coarse for, in s
DETAIL_STEPS = 2  # moves along normals after the steps of the centers; a third gains a fourth of what the second does


@dataclass(frozen=True)
class Alignment(FrozenArrays):
    """targets : (C, 3) the frame's own reference centers X'_f.  mesh : the frame's, mapped.  before, after : IoU with the anchor frame."""

    targets: np.ndarray
    mesh: TriangleMesh
    before: float
    after: float


@dataclass(frozen=True)
class AnchorFrame:
    """The mapped anchor frame, ready to be aligned with.

    tree : of points spread densely over its surface, the closest of which takes the place of the closest point: its tangent
    plane is what counts, and it is found several times as fast.  normals : of the surface at these points.
    """

    tree: cKDTree
    normals: np.ndarray
    grid: Grid
    inside: np.ndarray

    @classmethod
    def of(cls, mesh: TriangleMesh, whole: np.ndarray, centers: int) -> AnchorFrame:
        """mesh : mapped anchor frame.  whole : (T,) bool, its triangles that do not span a tear.  centers : how many will move."""
        surface = TriangleMesh(mesh.vertices, mesh.triangles[whole])
        points, owners = sample_surface(surface, DENSE_POINTS * centers, np.random.default_rng(0))
        grid = grid_around(mesh.vertices, IOU_RESOLUTION)
        return cls(cKDTree(points), triangle_normals(surface)[owners], grid, fill(closed_apart(mesh, whole), grid))

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
    links = sparse.csgraph.laplacian(_graph(frame.affinity))
    for rigidity in np.geomspace(STIFFEST, SOFTEST, steps):
        move = _pull(mesh, frame, anchor, rigidity * links)
        for share in STEP_SHARES:
            candidate = frame.to(targets + share * move)
            score = anchor.iou(frame.closed(candidate))
            if score > best:
                targets, mesh, best = targets + share * move, candidate, score
                break
    for _ in range(DETAIL_STEPS if steps and frame.mapping == "affinity" else 0):  # the paper moves centers only
        candidate = _detailed(mesh, frame, anchor)
        score = anchor.iou(frame.closed(candidate))
        if score > best:
            mesh, best = candidate, score
    return Alignment(targets, mesh, before, best)


def _pull(mesh: TriangleMesh, frame: FrameMap, anchor: AnchorFrame, smoothness: sparse.csr_matrix) -> np.ndarray:
    """(C, 3) moves of the centers that bring surface points onto the tangent planes of their partners."""
    weights = frame.binding.weights
    stride = max(1, len(mesh.vertices) // (MOST_POINTS * weights.shape[1]))
    chosen = np.arange(0, len(mesh.vertices), stride)
    found, normals, gap = _gaps(mesh.vertices[chosen], vertex_normals(mesh)[chosen], frame.spacing, anchor)
    return _moved_centers(weights[chosen[found]], normals, gap, smoothness)


def _detailed(mesh: TriangleMesh, frame: FrameMap, anchor: AnchorFrame) -> TriangleMesh:
    """The mapped frame with each vertex moved along its normal towards its partner's tangent plane, smoothly up to a tear."""
    surface = TriangleMesh(mesh.vertices, mesh.triangles[frame.whole(mesh)])
    found, normals, gap = _gaps(mesh.vertices, vertex_normals(surface), frame.spacing, anchor)
    return mesh.moved(moved_along_normals(surface, found, mesh.vertices[found] + gap[:, None] * normals, DETAIL * frame.spacing))


def _gaps(points: np.ndarray, normals: np.ndarray, spacing: float, anchor: AnchorFrame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N,) indices of points that have a partner on the anchor frame, its (N, 3) normal, and the (N,) way to its tangent plane."""
    distance, partner = anchor.tree.query(points, distance_upper_bound=GATE * spacing)
    found = np.flatnonzero(np.isfinite(distance))
    found = found[row_dot(anchor.normals[partner[found]], normals[found]) > COMPATIBLE]
    theirs = anchor.normals[partner[found]]
    return found, theirs, row_dot(theirs, anchor.tree.data[partner[found]] - points[found])


def _moved_centers(weights, normals, gap, smoothness: sparse.csr_matrix) -> np.ndarray:
    """Least squares: n . (W d) = gap for each point, d small by the (C, C) Laplacian `smoothness`.

    Conjugate gradients, since the normal equations would cost more to multiply out than to solve.
    """
    count = weights.shape[1]
    rows = sparse.hstack([weights.multiply(normals[:, [k]]) for k in range(3)]).tocsr()
    columns = rows.T.tocsr()
    per_center = len(gap) / count
    smooth = sparse.block_diag([smoothness * per_center] * 3) + sparse.identity(3 * count) * (DAMPING * max(per_center, 1.0))
    smooth = smooth.tocsr()
    system = LinearOperator(smooth.shape, matvec=lambda d: columns @ (rows @ d) + smooth @ d, dtype=float)
    diagonal = np.asarray(columns.power(2).sum(axis=1)).ravel() + smooth.diagonal()
    solved, _ = cg(system, columns @ gap, rtol=TOLERANCE, M=sparse.diags(1 / diagonal))
    return solved.reshape(3, count).T


def _graph(affinity: sparse.csr_matrix) -> sparse.csr_matrix:
    """Each center with its STRONGEST kin, symmetric, without the diagonal: few enough for a sparse factorisation."""
    pairs = sparse.coo_matrix(affinity - sparse.diags(affinity.diagonal()))
    order = np.lexsort((pairs.col, -pairs.data, pairs.row))
    rank = np.arange(pairs.nnz) - np.searchsorted(pairs.row[order], pairs.row[order])
    kept = order[rank < STRONGEST]
    graph = sparse.csr_matrix((pairs.data[kept] / STRONGEST, (pairs.row[kept], pairs.col[kept])), pairs.shape)
    return graph.maximum(graph.T)
