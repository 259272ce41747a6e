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

from ..geometry.mesh import vertex_normals
from ..geometry.vectors import row_dot
from ..types import FrozenArrays, TriangleMesh
from .anchor_frame import AnchorFrame
from .detail import moved_along_normals
from .mapping import FrameMap

GATE = 1.0  # farthest partner of a surface point, in s
COMPATIBLE = 0.6  # least cosine between the normals of partners
# Weight of the affinity graph's smoothness against one surface point per center, at the first and the last step: large parts
# move as one before small ones follow, or single centers run to the wrong side of a fold of cloth (Amberg et al. 2007).
STIFFEST, SOFTEST = 10.0, 0.3
DAMPING = 1e-3  # keeps centers that no surface point pulls where they are
POINTS_PER_CENTER = 12  # surface points that take part in one step, at most
TOLERANCE = 1e-3  # of a step's solution, far below what the next step changes
STEP_SHARES = (1.0, 0.5, 0.25)  # damped steps tried before one is refused
DETAIL = 0.25  # extent of the detail that the centers are too coarse for, in s
DETAIL_STEPS = 2  # moves along normals after the steps of the centers; a third gains a fourth of what the second does


@dataclass(frozen=True)
class Alignment(FrozenArrays):
    """targets : (C, 3) the frame's own reference centers X'_f.  mesh : the frame's, mapped.
    whole : (T,) bool, its triangles that do not span a tear.  before, after : IoU with the anchor frame.
    """

    targets: np.ndarray
    mesh: TriangleMesh
    whole: np.ndarray
    before: float
    after: float


@dataclass(frozen=True)
class _Overlap(FrozenArrays):
    """A mapped mesh, its triangles (T,) that do not span a tear, and its IoU with the anchor frame."""

    mesh: TriangleMesh
    whole: np.ndarray
    iou: float

    @classmethod
    def of(cls, mesh: TriangleMesh, frame: FrameMap, anchor: AnchorFrame) -> _Overlap:
        whole = frame.whole(mesh)
        return cls(mesh, whole, anchor.iou(frame.closed(mesh, whole)))


def align(frame: FrameMap, targets: np.ndarray, anchor: AnchorFrame, steps: int) -> Alignment:
    """Moves a frame's reference centers so that its mapped mesh covers the anchor frame's volume better.

    targets : (C, 3) reference centers to start from.  steps : at most.
    The IoU never falls: a step that would lower it is damped, then refused.

    >>> frame = FrameMap(ball, tracked.centers, tracked.affinity.weights(), tracked.affinity.spacing)
    >>> anchor = AnchorFrame.of(ball, frame.whole(ball), frame.affinity)
    >>> alignment = align(frame, tracked.centers + [0.2, 0, 0], anchor, steps=5)
    >>> alignment.before < 0.8 and alignment.after > 0.99
    True
    """
    best = start = _Overlap.of(frame.to(targets), frame, anchor)
    for rigidity in np.geomspace(STIFFEST, SOFTEST, steps):
        move = _pull(best.mesh, frame, anchor, rigidity)
        for share in STEP_SHARES:
            candidate = _Overlap.of(frame.to(targets + share * move), frame, anchor)
            if candidate.iou > best.iou:
                targets, best = targets + share * move, candidate
                break
    for _ in range(DETAIL_STEPS if steps and frame.mapping == "affinity" else 0):  # the paper moves centers only
        candidate = _Overlap.of(_detailed(best, frame, anchor), frame, anchor)
        best = candidate if candidate.iou > best.iou else best
    return Alignment(targets, best.mesh, best.whole, start.iou, best.iou)


def _pull(mesh: TriangleMesh, frame: FrameMap, anchor: AnchorFrame, rigidity: float) -> np.ndarray:
    """(C, 3) moves of the centers that bring surface points onto the tangent planes of their partners."""
    weights = frame.binding.weights
    stride = max(1, len(mesh.vertices) // (POINTS_PER_CENTER * weights.shape[1]))
    chosen = np.arange(0, len(mesh.vertices), stride)
    matched, normals, gap = plane_gaps(mesh.vertices[chosen], vertex_normals(mesh)[chosen], frame.spacing, anchor.tree, anchor.normals)
    return moved_centers(weights[chosen[matched]], normals, gap, rigidity * anchor.laplacian)


def _detailed(overlap: _Overlap, frame: FrameMap, anchor: AnchorFrame) -> TriangleMesh:
    """The mapped frame with each vertex moved along its normal toward its partner's tangent plane, smoothly up to a tear."""
    mesh = overlap.mesh
    surface = TriangleMesh(mesh.vertices, mesh.triangles[overlap.whole])
    matched, normals, gap = plane_gaps(mesh.vertices, vertex_normals(surface), frame.spacing, anchor.tree, anchor.normals)
    goals = mesh.vertices[matched] + gap[:, None] * normals
    return mesh.moved(moved_along_normals(surface, matched, goals, DETAIL * frame.spacing))


def plane_gaps(
    points: np.ndarray, normals: np.ndarray, spacing: float, tree: cKDTree, partner_normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N,) indices of points that have a partner on the anchor frame, its (N, 3) normal, and the (N,) way to its tangent plane.

    points, normals : (P, 3) of the mapped frame.  tree, partner_normals : of points on the anchor frame.
    """
    distance, partner = tree.query(points, distance_upper_bound=GATE * spacing)
    near = np.flatnonzero(np.isfinite(distance))
    matched = near[row_dot(partner_normals[partner[near]], normals[near]) > COMPATIBLE]
    planes = partner_normals[partner[matched]]
    return matched, planes, row_dot(planes, tree.data[partner[matched]] - points[matched])


def moved_centers(weights: sparse.csr_matrix, normals: np.ndarray, gap: np.ndarray, smoothness: sparse.csr_matrix) -> np.ndarray:
    """(C, 3) moves d by least squares: n . (W d) = gap for each point, d small by the (C, C) Laplacian `smoothness`.

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
    moves, _ = cg(system, columns @ gap, rtol=TOLERANCE, M=sparse.diags(1 / diagonal))
    return moves.reshape(3, count).T
