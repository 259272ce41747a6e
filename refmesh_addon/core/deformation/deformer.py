"""One reference mesh deformed to the frames of its group: what the frames share is built once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from scipy import sparse
from scipy.spatial.transform import Rotation

from ..geometry.closest_point import SurfaceIndex
from ..geometry.mesh import mean_edge_length
from ..geometry.rings import grown
from ..geometry.subdivision import with_short_edges
from ..geometry.winding import Enclosed, enclosed_by, nothing_enclosed_by
from ..latest import latest_only
from ..reference.group import GroupCenters
from ..reference.mapping import FrameMap
from ..settings import DeformationSettings
from ..surfacing.hole_caps import smoothly_capped
from ..types import FrozenArrays, Keyed, TriangleMesh
from .arap import ArapSolver
from .cap_targets import RINGS, CapTargets
from .contact import behind_contact, possible_owners
from .correspondence import Compatible, Correspondence
from .facing import Facing
from .feature_targets import FeatureTargets
from .folds import unfolded
from .keypoints import PUBLISHED_KEYPOINTS, KeypointSettings, find_keypoints
from .matching import PUBLISHED_SEARCH, MatchSettings, in_reach, match_keypoints
from .out_of_view import out_of_view
from .outliers import Surroundings, VisibleSource, without_outliers
from .patches import PATCH_RADIUS, Patches, surface_patches
from .presence import ABSENT, OUT_OF_VIEW, absent_bodies
from .strain_relief import StrainRelief
from .surface_fit import NOTHING, FitResult, Unpaired, fit_surface
from .surface_samples import SurfaceSampler

START_WEIGHT = 0.5  # pull of every vertex to where the centers carry it: key points are an edge or so off and must not win everywhere
FOLLOWING_WEIGHT = 0.01  # the same of vertices that only follow those whose places are known: they must not keep a shape that has gone on
TOLERANCE = 1e-5  # share of the energy per iteration of ARAP; the surface then moves by some ten thousandths of an edge
# In s: a triangle has one place for all of it where the bodies that it may belong to are sought, so that larger ones are divided.
LONGEST_EDGE = 2.5
COMPATIBLE_AFFINITY = 0.02  # of two centers above which their surfaces may be fitted to each other


@dataclass(frozen=True, eq=False)
class GroupReference(Keyed):
    """What is to be deformed, and how.

    mesh : the reference mesh of a group.  centers : what the frames of the group share.
    mapping : how frames were carried to the reference positions, "affinity" or "rbf"; the mesh goes back in the same way.
    is_open : whether frames enclose nothing, so that no point lies inside of them.
    is_view : whether frames are what a camera sees, so that surface without a source is out of view.
    features : (K, 2) edges of the mesh that follow the sharp edges and rims of the frames; None for none.
    caps : (K,) vertices of the mesh that close holes of the frames; None for none.
    """

    key: str
    mesh: TriangleMesh
    centers: GroupCenters
    settings: DeformationSettings
    mapping: str = "affinity"
    is_open: bool = False
    is_view: bool = False
    features: np.ndarray | None = None
    caps: np.ndarray | None = None


@dataclass(frozen=True)
class DeformedFrame(FrozenArrays):
    """The reference mesh of a group deformed to one of its frames.

    vertices : (R, 3) scene units.  keypoints : (K,) indices of the vertices that were matched.  keypoint_targets : (K, 3) where to.
    held : (R,) bool, vertices that ARAP alone placed.  hidden : (R,) bool, vertices that lie in a contact.
    absent : (R,) bool, vertices of bodies that the frame does not show at all.
    curled : (S,) bool, triangles that face against their surroundings as the source does there.
    rotation_vectors : (R, 3) rotation of the surroundings of each vertex by the centers, axis times angle in radians.
    """

    vertices: Annotated[np.ndarray, "(R, 3) float64"]
    keypoints: Annotated[np.ndarray, "(K) integer"]
    keypoint_targets: Annotated[np.ndarray, "(K, 3) float64"]
    held: Annotated[np.ndarray, "(R) bool"]
    hidden: Annotated[np.ndarray, "(R) bool"]
    absent: Annotated[np.ndarray, "(R) bool"]
    curled: Annotated[np.ndarray, "(S) bool"]
    rotation_vectors: Annotated[np.ndarray, "(R, 3) float64"]

    @property
    def rotations(self) -> np.ndarray:
        """(R, 3, 3) rotation matrices of the vertices' surroundings."""
        return Rotation.from_rotvec(self.rotation_vectors.copy()).as_matrix()  # SciPy wants an array that it might write to


@dataclass(frozen=True)
class Pose(FrozenArrays):
    """The reference mesh of a group before it is fitted to a frame.

    vertices : (R, 3) scene units.  rotations : (R, 3, 3) of their surroundings.  owners : (R,) centers that they belong to.
    handles : (K,) vertices of matched key points.  goals : (K, 3) positions of their partners.
    """

    vertices: np.ndarray
    rotations: np.ndarray
    owners: np.ndarray
    handles: np.ndarray
    goals: np.ndarray


class ReferenceDeformer:
    """Built once from a group's reference mesh, then deforms it to each frame of the group."""

    def __init__(self, reference: GroupReference):
        self._mesh, self._group, self._settings, self._mapping = reference.mesh, reference.centers, reference.settings, reference.mapping
        self._is_open, self._enclosed_by = reference.is_open, nothing_enclosed_by if reference.is_open else enclosed_by
        self._features, self._caps, self._is_view = reference.features, reference.caps, reference.is_view
        self._search = match_settings(reference.settings)
        self._solver = ArapSolver(reference.mesh, reference.settings.smoothness, TOLERANCE)
        self._sampler = SurfaceSampler(reference.mesh)
        self._relief = StrainRelief(self._solver, _on_targets(reference, self._solver.energy.adjacency))
        self._length = mean_edge_length(reference.mesh)
        self._patches = self._patches_at(reference.mesh, self._keypoints_of(reference.mesh))
        self._compatible = (reference.centers.affinity > COMPATIBLE_AFFINITY).toarray()

    def to(self, targets: np.ndarray, mesh: TriangleMesh, centers: np.ndarray) -> DeformedFrame:
        """The reference mesh in one frame.

        targets : (C, 3) the frame's own reference centers.  mesh : the frame.  centers : (C, 3) the same in the frame.
        """
        carrier = self._carrier(targets)
        start, rotations = carrier.to(centers).vertices, carrier.rotations_to(centers)
        handles, goals = self._matched(start, rotations, mesh)
        pose = Pose(self._posed(handles, goals, start), rotations, carrier.binding.owners, handles, goals)
        return self._fitted(pose, mesh, centers)

    def fitted_again(
        self, frame: DeformedFrame, vertices: np.ndarray, known: np.ndarray, targets: np.ndarray, mesh: TriangleMesh, centers: np.ndarray
    ) -> DeformedFrame:
        """A deformed frame after its vertices were moved along the surface: on the source again, as when it was first deformed.

        vertices : (R, 3) where they were moved to.  known : (R,) bool, those that belong there. Between them the mesh takes its own shape
        again: the dent of a contact belongs to other vertices now.
        targets, mesh, centers : those that `to` took.
        """
        handles = np.flatnonzero(known)
        rounds = self._settings.arap_iterations
        vertices = self._solver.deform(handles, vertices[handles], vertices, iterations=rounds, start_weight=FOLLOWING_WEIGHT).vertices
        pose = Pose(vertices, frame.rotations, self._carrier(targets).binding.owners, frame.keypoints, frame.keypoint_targets)
        return self._fitted(pose, mesh, centers)

    def _carrier(self, targets: np.ndarray) -> FrameMap:
        return FrameMap(self._mesh, targets, self._group.affinity, self._group.spacing, self._mapping)

    def _fitted(self, pose: Pose, mesh: TriangleMesh, centers: np.ndarray) -> DeformedFrame:
        """The posed mesh on the source, without folds and outliers."""
        owners, rotations = pose.owners, pose.rotations
        mesh = with_short_edges(mesh, LONGEST_EDGE * self._group.spacing)
        source, enclosed = SurfaceIndex(mesh), self._enclosed_by(mesh)
        compatible = self._compatible_pairs(owners, possible_owners(mesh, centers, self._group.spacing))
        correspondence = Correspondence(source, self._sampler, compatible, enclosed, self._is_open)
        unpaired = self._unpaired(mesh, compatible)
        fitted = fit_surface(self._solver, pose.vertices, correspondence, self._settings.fit_rounds, unpaired=unpaired)
        facing = Facing(self._mesh, rotations, source)
        hidden = self._hidden(owners, centers, enclosed)
        placed = self._relieved(fitted, hidden(fitted.vertices), correspondence)
        unseen = hidden(placed) | self._out_of_view(placed, fitted.held, facing)
        deformed = self._mesh.moved(unfolded(self._solver, placed, pose.vertices, facing, unseen))
        if self._settings.fit_rounds:  # otherwise all of the surface is off the source
            around = Surroundings.of(self._solver.energy.adjacency, self._length, fitted.held | hidden(deformed.vertices))
            deformed = without_outliers(deformed, facing, around, VisibleSource(source, enclosed))
        return DeformedFrame(
            deformed.vertices,
            pose.handles,
            pose.goals,
            held=fitted.held,
            hidden=hidden(deformed.vertices),
            absent=absent_bodies(deformed, source, enclosed, OUT_OF_VIEW if self._is_view else ABSENT),
            curled=facing.curled(deformed.vertices),
            rotation_vectors=Rotation.from_matrix(rotations).as_rotvec(),
        )

    def _relieved(self, fitted: FitResult, hidden: np.ndarray, correspondence: Correspondence) -> np.ndarray:
        """(R, 3) vertices of a fit without strains that sliding relieves; those of open surfaces, whose borders move, as they are."""
        if self._is_view or not self._settings.fit_rounds:
            return fitted.vertices
        return self._relief.relieved(fitted.vertices, correspondence, ~(fitted.held | hidden))

    def _hidden(self, owners: np.ndarray, centers: np.ndarray, enclosed: Enclosed) -> Callable[[np.ndarray], np.ndarray]:
        """Which vertices lie in a contact, (R,) bool, where they are at (R, 3) positions; arguments as of `behind_contact`."""
        return lambda vertices: behind_contact(
            self._mesh.moved(vertices), owners, centers, self._compatible, enclosed, self._group.spacing
        )

    def _out_of_view(self, vertices: np.ndarray, held: np.ndarray, facing: Facing) -> np.ndarray:
        """(R,) bool, vertices that a camera does not show, none where bodies are seen all round.  held : (R,) those without a source."""
        if not self._is_view:
            return np.zeros_like(held)
        around = Surroundings(self._solver.energy.adjacency, self._length, held)
        return out_of_view(self._mesh.moved(vertices), facing, around)

    def _unpaired(self, mesh: TriangleMesh, compatible: Compatible) -> Unpaired:
        """The feature lines and the caps of a frame, where the reference mesh has any."""
        features, caps = (None if some is None or not len(some) else some for some in (self._features, self._caps))
        if features is None and caps is None:
            return NOTHING
        capped = smoothly_capped(mesh)
        lines = None if features is None else FeatureTargets(features, capped, self._length, compatible)
        return Unpaired(lines, None if caps is None else CapTargets(caps, self._solver.energy.adjacency, capped))

    def _keypoints_of(self, mesh: TriangleMesh) -> np.ndarray:
        return find_keypoints(mesh, self._length, KeypointSettings() if self._search.guided else PUBLISHED_KEYPOINTS)

    def _patches_at(self, mesh: TriangleMesh, keypoints: np.ndarray) -> Patches:
        return surface_patches(mesh, keypoints, PATCH_RADIUS * self._length)

    def _matched(self, start: np.ndarray, rotations: np.ndarray, mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
        """(K,) vertices of the reference that match a key point of the frame, and the (K, 3) positions of these."""
        own, keypoints = self._patches, self._keypoints_of(mesh)
        places = start[own.vertices]
        reachable = keypoints[in_reach(mesh.vertices[keypoints], places, own.radius, self._search)]
        matches = match_keypoints(own, theirs := self._patches_at(mesh, reachable), places, rotations[own.vertices], self._search)
        return own.vertices[matches.reference], theirs.positions[matches.frame]

    def _posed(self, handles: np.ndarray, goals: np.ndarray, start: np.ndarray) -> np.ndarray:
        """(R, 3) start with the handles pulled to their goals."""
        if not len(handles):
            return start
        return self._solver.deform(handles, goals, start, iterations=self._settings.arap_iterations, start_weight=START_WEIGHT).vertices

    def _compatible_pairs(self, own: np.ndarray, others: np.ndarray) -> Compatible:
        """own : (R,) centers of the reference vertices.  others : (T, k) those that the frame's triangles may belong to."""
        return lambda vertices, triangles: self._compatible[own[vertices, None], others[triangles]].any(axis=1)


def deform_reference(reference: GroupReference, targets: np.ndarray, mesh: TriangleMesh, centers: np.ndarray) -> DeformedFrame:
    """`ReferenceDeformer.to`, built anew only where the last call in this process was for another group."""
    return _deformer(reference).to(targets, mesh, centers)


def match_settings(settings: DeformationSettings) -> MatchSettings:
    """The search for partners of key points that a job asks for."""
    search = MatchSettings() if settings.keypoint_search == "guided" else PUBLISHED_SEARCH
    return replace(search, fixed_point=settings.keypoint_fit == "fixed")


def _on_targets(reference: GroupReference, adjacency: sparse.csr_matrix) -> np.ndarray:
    """(R,) bool, vertices that the fit has brought to feature lines and caps of a frame, of which closest points know nothing."""
    on_lines, on_caps = np.zeros((2, len(reference.mesh.vertices)), dtype=bool)
    for marked, vertices in ((on_lines, reference.features), (on_caps, reference.caps)):
        marked[[] if vertices is None else vertices] = True
    return on_lines | grown(adjacency, on_caps, RINGS)


@latest_only
def _deformer(reference: GroupReference) -> ReferenceDeformer:
    return ReferenceDeformer(reference)
