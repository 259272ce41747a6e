"""Carrying points from one set of center positions to another (paper, section "Mesh mapping and alignment optimization").

Two mappings with one face, `FrameMap.to`: the paper's thin-plate spline, and affinity blending, in which a point follows
the rigid motions of the centers on its own side of a contact, so that it tears where the volume does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..geometry.mesh import vertex_normals
from ..geometry.rotations import RigidMotions, closest_rotations, rigid_motions
from ..settings import choices_of
from ..types import TriangleMesh
from ..variants import check_variant
from .tears import Tears

INWARD = 0.35  # depth below the surface, in s, at which a point is assigned to its nearest center: inside even a thin limb
NEIGHBORS = 16  # centers that a point may follow; beyond the second shell they add nothing but cost
POINTS_AT_ONCE = 2000  # points of one batch of the dense spline evaluation: bounds its memory


@dataclass(frozen=True)
class Binding:
    """Which centers points follow, and with which weights.

    weights : (P, C) sparse, rows sum to one.  owners : (P,) the center whose side of a contact the point is on.
    """

    weights: sparse.csr_matrix
    owners: np.ndarray


def bind(mesh: TriangleMesh, centers: np.ndarray, affinity: sparse.csr_matrix, spacing: float) -> Binding:
    """Binds the vertices of a mesh to (C, 3) centers.

    affinity : (C, C) weights with ones on the diagonal.  spacing : s, scene units.
    The owner is the center nearest to a point just inside; the others count by nearness and by their affinity to it.
    """
    tree = cKDTree(centers)
    inner = mesh.vertices - INWARD * spacing * vertex_normals(mesh)
    distance, near = tree.query(inner, k=np.arange(1, min(NEIGHBORS, len(centers)) + 1), workers=-1)
    owners = near[:, 0]
    # Falls to zero at the farthest neighbor, so that nothing jumps where the set of neighbors changes.
    closeness = (1 - distance / np.maximum(distance[:, -1:], np.finfo(float).tiny)) ** 2
    closeness[:, 0] = np.maximum(closeness[:, 0], np.finfo(float).eps)
    rows = np.repeat(np.arange(len(inner)), near.shape[1])
    affinities = np.asarray(affinity[np.repeat(owners, near.shape[1]), near.ravel()]).reshape(near.shape)
    value = closeness * affinities
    value /= value.sum(axis=1, keepdims=True)
    weights = sparse.csr_matrix((value.ravel(), (rows, near.ravel())), shape=(len(inner), len(centers)))
    weights.eliminate_zeros()
    return Binding(weights, owners)


def blended(binding: Binding, points: np.ndarray, motions: RigidMotions) -> np.ndarray:
    """(P, 3) points carried by the weighted mean of their centers' rigid motions."""
    offsets = motions.targets - np.einsum("nij,nj->ni", motions.rotations, motions.sources)
    table = np.hstack([motions.rotations.reshape(-1, 9), offsets])
    mixed = binding.weights @ table
    return np.einsum("nij,nj->ni", mixed[:, :9].reshape(-1, 3, 3), points) + mixed[:, 9:]


class FrameMap:
    """A mesh bound to (C, 3) centers, carried to any other positions of theirs.

    affinity : (C, C) weights of the group, ones on the diagonal.  spacing : s, scene units.
    mapping : "affinity", or "rbf", the paper's equation (4). Raises ValueError for another one.

    >>> frame = FrameMap(ball, tracked.centers, tracked.affinity.weights(), tracked.affinity.spacing)
    >>> np.abs(frame.to(tracked.centers + [1, 0, 0]).vertices.mean(axis=0)).round(2)
    array([1., 0., 0.])
    """

    def __init__(self, mesh: TriangleMesh, centers: np.ndarray, affinity: sparse.csr_matrix, spacing: float, mapping: str = "affinity"):
        check_variant("mapping", mapping, choices_of("mapping"))
        self.mesh, self.centers, self.affinity, self.spacing, self.mapping = mesh, centers, affinity, spacing, mapping
        self.binding = bind(mesh, centers, affinity, spacing)
        self._tears = Tears(mesh, spacing)

    def to(self, targets: np.ndarray) -> TriangleMesh:
        """The mesh carried to (C, 3) target centers: exactly where they go for "rbf", near it for "affinity", which blends."""
        if self.mapping == "rbf":
            return self.mesh.moved(spline_mapped(self.mesh.vertices, self.centers, targets))
        turns = rigid_motions(self.affinity, self.centers, targets).rotations
        return self.mesh.moved(blended(self.binding, self.mesh.vertices, RigidMotions(turns, self.centers, targets)))

    def rotations_to(self, targets: np.ndarray) -> np.ndarray:
        """(V, 3, 3) how the surroundings of each vertex turn on the way to (C, 3) targets."""
        turns = rigid_motions(self.affinity, self.centers, targets).rotations
        return closest_rotations((self.binding.weights @ turns.reshape(-1, 9)).reshape(-1, 3, 3))

    def whole(self, mapped: TriangleMesh) -> np.ndarray:
        """(T,) bool, triangles of the carried mesh that do not span a tear."""
        return self._tears.whole(mapped.vertices)

    def closed(self, mapped: TriangleMesh, whole: np.ndarray | None = None) -> TriangleMesh:
        """The carried mesh with caps where it has torn: bodies that part enclose nothing of what is between them.

        whole : (T,) bool, its triangles that do not span a tear, where that is known already.
        """
        return self._tears.closed(mapped, self.whole(mapped) if whole is None else whole)


def spline_mapped(points: np.ndarray, source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """(P, 3) points carried by the thin-plate spline from (C, 3) source to target centers; paper, equation (4)."""
    from scipy.interpolate import RBFInterpolator  # late: processes that need no spline start a fifth sooner

    spline = RBFInterpolator(source, target, kernel="thin_plate_spline")
    return np.concatenate([spline(points[start : start + POINTS_AT_ONCE]) for start in range(0, len(points), POINTS_AT_ONCE)])
