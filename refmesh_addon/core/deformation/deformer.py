"""One reference mesh deformed to the frames of its group: what the frames share is built once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import mean_edge_length
from ..geometry.winding import enclosed_by
from ..reference.group import GroupCenters
from ..reference.mapping import FrameMap
from ..settings import DeformationSettings
from ..types import TriangleMesh
from .arap import ArapSolver
from .contact import behind_contact, possible_owners
from .correspondence import Compatible
from .folds import Facing, unfolded
from .keypoints import find_keypoints
from .matching import MatchSettings, in_reach, match_keypoints
from .patches import PATCH_RADIUS, Patches, surface_patches
from .surface_fit import fit_surface

KEEP = 0.5  # pull of every vertex to where the centers carry it: key points lie an edge or so off and must not win everywhere
SETTLED = 1e-5  # share of the energy per iteration; the surface then moves by some ten thousandths of an edge
KIN = 0.02  # least affinity of two centers whose surfaces may be fitted to each other


@dataclass(frozen=True)
class GroupShape:
    """What is to be deformed, and how; equal `key`, equal shape.

    mesh : the reference.  centers : what its frames share.
    """

    key: str
    mesh: TriangleMesh
    centers: GroupCenters
    settings: DeformationSettings


class ReferenceDeformer:
    """Built once from a group's reference mesh, asked for each of its frames."""

    def __init__(self, shape: GroupShape):
        self.key, self._mesh, self._group, self._settings = shape.key, shape.mesh, shape.centers, shape.settings
        self._solver = ArapSolver(shape.mesh, shape.settings.smoothness)
        self._length = mean_edge_length(shape.mesh)
        self._patches = self._patches_at(shape.mesh, self._keypoints_of(shape.mesh))
        self._akin = (shape.centers.affinity > KIN).toarray()

    def to(self, targets: np.ndarray, mesh: TriangleMesh, centers: np.ndarray) -> dict[str, np.ndarray]:
        """The reference mesh in one frame.

        targets : (C, 3) the frame's own reference centers.  mesh : the frame.  centers : (C, 3) the same in the frame.
        Returns `vertices` (R, 3); `keypoints` (K,) and `keypoint_targets` (K, 3), the matched ones; `held` (R,), which
        vertices ARAP alone placed; `hidden` (R,), which lie in a contact; `curled` (S,), which triangles face against their
        surroundings as the source does there; `turns` (R, 3), how the centers turn the surroundings of the vertices, as axes times
        angles in radians.
        """
        carrier = FrameMap(self._mesh, targets, self._group.affinity, self._group.spacing)
        index, turns = SurfaceIndex(mesh), carrier.rotations_to(centers)
        start = carrier.to(centers).vertices
        handles, goals = self._matched(start, turns, mesh)
        posed = self._posed(handles, goals, start)
        owners = carrier.binding.owners
        compatible = self._compatible(owners, possible_owners(mesh, centers, self._group.spacing))
        enclosed = enclosed_by(mesh)
        fitted = fit_surface(self._solver, posed, index, self._settings, compatible, enclosed)
        deformed = self._mesh.moved(unfolded(self._solver, fitted.vertices, posed, turns, index))
        facing = Facing(self._mesh, turns, index)
        return {
            "vertices": deformed.vertices,
            "keypoints": handles,
            "keypoint_targets": goals,
            "held": fitted.held,
            "hidden": behind_contact(deformed, owners, centers, self._akin, enclosed, self._group.spacing),
            "curled": facing.turned_over(deformed.vertices) & ~facing.folded(deformed.vertices),
            "turns": Rotation.from_matrix(turns).as_rotvec(),
        }

    def _keypoints_of(self, mesh: TriangleMesh) -> np.ndarray:
        return find_keypoints(mesh, self._length)

    def _patches_at(self, mesh: TriangleMesh, keypoints: np.ndarray) -> Patches:
        return surface_patches(mesh, keypoints, PATCH_RADIUS * self._length)

    def _matched(self, start: np.ndarray, turns: np.ndarray, mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
        """Vertices of the reference that have a partner among the key points of the frame, and the partners' (K, 3) positions."""
        settings = MatchSettings(guided=self._settings.keypoint_search == "guided", fixed_point=self._settings.keypoint_fit == "fixed")
        own, found = self._patches, self._keypoints_of(mesh)
        places = start[own.vertices]
        theirs = self._patches_at(mesh, found[in_reach(mesh.vertices[found], places, own.radius, settings)])
        matches = match_keypoints(own, theirs, places, turns[own.vertices], settings)
        return own.vertices[matches.reference], theirs.positions[matches.frame]

    def _posed(self, handles: np.ndarray, goals: np.ndarray, start: np.ndarray) -> np.ndarray:
        if not len(handles):
            return start
        return self._solver.deform(handles, goals, start, iterations=self._settings.arap_iterations, keep=KEEP, settled=SETTLED).vertices

    def _compatible(self, own: np.ndarray, others: np.ndarray) -> Compatible:
        """own : (R,) centers of the reference vertices.  others : (T, k) those that the frame's triangles may belong to."""
        return lambda vertices, triangles: self._akin[own[vertices, None], others[triangles]].any(axis=1)


_latest: list[ReferenceDeformer] = []  # of this process: frames come group by group, and one group fits any memory


def deform_reference(shape: GroupShape, targets: np.ndarray, mesh: TriangleMesh, centers: np.ndarray) -> dict[str, np.ndarray]:
    """`ReferenceDeformer.to`, built anew only where the last call in this process was for another group."""
    if not _latest or _latest[0].key != shape.key:
        _latest[:] = [ReferenceDeformer(shape)]
    return _latest[0].to(targets, mesh, centers)
