"""From tracked centers to the reference mesh of a group of frames: one short function per arrow, which any process can run."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..errors import RefMeshError
from ..geometry.clustering import clustered
from ..geometry.self_intersection import crossing_triangles
from ..settings import ReferenceSettings
from ..surfacing.feature_paths import with_feature_edges
from ..surfacing.hole_caps import CappedMesh
from ..surfacing.reconstruction import screened_poisson
from ..surfacing.remeshing import remeshed
from ..tracking.affinity import group_affinity
from ..types import FrozenArrays, TriangleMesh
from .alignment import align
from .anchor_frame import AnchorFrame, ShownSurface
from .budget import ALIGNED_VERTICES, DENSE_TRIANGLES
from .cap_points import HoleFinder, OrientedPoints, counting
from .frame_features import FrameFeatures, SharedFeatures, frame_features
from .free_space import FreeSpace
from .mapping import FrameMap
from .open_alignment import align_open
from .oriented_points import oriented_points
from .reference_centers import reference_centers
from .separation import bodies_of, separated, within_bodies
from .support import without_bubbles


@dataclass(frozen=True)
class GroupTracks(FrozenArrays):
    """What the reference centers of a group are made from.

    positions : (F, C, 3) tracked centers, scene units.  weights : (C, C) affinities of the tracking.  spacing : s, scene units.
    penalty : (F,) what speaks against each frame as the anchor frame, as `reference_centers` takes it.
    """

    positions: np.ndarray
    weights: sparse.csr_matrix
    spacing: float
    penalty: np.ndarray | None = None


@dataclass(frozen=True)
class GroupCenters(FrozenArrays):
    """What all frames of a group share: centers in reference positions and their affinity.

    positions : (C, 3) reference centers.  affinity : (C, C) weights within the group.  spacing : s, scene units.
    anchor : index of the anchor frame in the group.  stress : of the reference centers, as `reference_centers` gives it.
    """

    positions: Annotated[np.ndarray, "(C, 3) float64"]
    affinity: sparse.csr_matrix
    spacing: float
    anchor: int
    stress: float


@dataclass(frozen=True)
class AlignedFrame(FrozenArrays):
    """A frame carried to the reference positions.

    targets : (C, 3) the frame's own reference centers.  surface : points on its surface, with those on caps.
    iou_before, iou_after : overlap with the anchor frame, before and after alignment, 0 to 1.  features : its sharp edges and rims.
    """

    targets: Annotated[np.ndarray, "(C, 3) float64"]
    surface: OrientedPoints
    iou_before: float
    iou_after: float
    features: FrameFeatures


@dataclass(frozen=True)
class GroupSurface(FrozenArrays):
    """What the frames of a group show, in reference positions.

    points, normals : (P, 3).  on_cap : (P,) bool, over holes of the anchor frame.  features : lines that they share.
    """

    points: Annotated[np.ndarray, "(P, 3) float64"]
    normals: Annotated[np.ndarray, "(P, 3) float64"]
    on_cap: Annotated[np.ndarray, "(P) bool"]
    features: FrameFeatures


@dataclass(frozen=True)
class ReferenceMesh(FrozenArrays):
    """The reference mesh of a group.  self_intersections : triangles that cross another one.

    features : (K, 2) edges of the mesh on the sharp edges and rims of the capture.  caps : (N,) vertices over its holes.
    """

    mesh: TriangleMesh
    self_intersections: int
    features: Annotated[np.ndarray, "(K, 2) int32"] = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int32))
    caps: Annotated[np.ndarray, "(N) int32"] = field(default_factory=lambda: np.zeros(0, dtype=np.int32))


def place_centers(
    tracks: GroupTracks, settings: ReferenceSettings, bodies: np.ndarray | None = None, by_body: bool = False
) -> GroupCenters:
    """Reference centers and affinity of a group.

    bodies : (C,) marked bodies that must be apart, as `marked_bodies` gives them; None for none.
    by_body : distances between bodies that the take has shown apart do not shape either, as over a long run of frames.
    """
    positions, spacing, weights = tracks.positions, tracks.spacing, within_bodies(tracks.weights, bodies)
    own = bodies_of(positions[0], weights) if by_body else None
    reference = reference_centers(positions, counted=settings.stress, bodies=own, penalty=tracks.penalty)
    affinity = group_affinity(positions, reference.anchor, weights, spacing).weights()
    # Bodies that the whole take has shown apart are two also in a group that never shows them apart.
    affinity = within_bodies(within_bodies(affinity, bodies_of(reference.positions, weights)), bodies)
    placed = reference.positions
    if settings.mapping == "affinity":  # the spline cannot tear: with bodies separated it would smear over a wider gap
        # Within a group any affinity joins: a limb that bends sharply against the anchor frame is not a body of its own.
        placed = separated(placed, bodies_of(placed, affinity, joined=0.0), spacing)
    return GroupCenters(placed, affinity, spacing, reference.anchor, reference.stress)


def anchor_frame(
    body: CappedMesh, centers: np.ndarray, group: GroupCenters, settings: ReferenceSettings, surface: np.ndarray | None = None
) -> AnchorFrame:
    """The anchor frame of a group, mapped to the reference positions: bound, sampled and voxelized once for all frames of the group.

    body : the anchor frame's.  centers : (C, 3) tracked centers in that frame, scene units.
    surface : (T,) bool, which triangles of an open take's frame show something; None for closed bodies.
    """
    body, kept = _for_alignment(body)
    frame = FrameMap(body.mesh, centers, group.affinity, group.spacing, settings.mapping)
    mapped = frame.to(group.positions)
    holes = HoleFinder(CappedMesh(mapped, body.holes), group.spacing)
    whole = frame.whole(mapped)
    anchor = AnchorFrame.of(mapped, whole, group.affinity, holes)
    if surface is None:
        return replace(anchor, free=FreeSpace(TriangleMesh(mapped.vertices, mapped.triangles[whole]), anchor.tree, group.spacing))
    return replace(anchor, shown=ShownSurface.of(mapped, surface[kept] & whole, group.spacing))


def align_frame(
    body: CappedMesh, centers: np.ndarray, anchor: AnchorFrame, group: GroupCenters, settings: ReferenceSettings, count: int
) -> AlignedFrame:
    """A frame carried to the reference positions and aligned with the anchor frame.

    body : the frame's.  centers : (C, 3) tracked centers in that frame, scene units.  anchor : from `anchor_frame`.
    count : oriented points to sample.
    """
    captured_body, body = body, _for_alignment(body)[0]
    frame = FrameMap(body.mesh, centers, group.affinity, group.spacing, settings.mapping)
    if anchor.shown is None:
        aligned = align(frame, group.positions, anchor, settings.alignment_steps)
    else:
        captured = np.zeros(len(body.mesh.vertices), dtype=bool)
        captured[body.mesh.triangles[body.holes < 0]] = True
        aligned = align_open(frame, group.positions, anchor, captured, settings.alignment_steps)
    points, normals, triangles = oriented_points(aligned.mesh, aligned.whole, count, np.random.default_rng(0))
    surface = anchor.counted(points, normals, body.holes[triangles] >= 0)
    mapped, whole = aligned.mesh, aligned.whole
    if captured_body is not body:  # a coarse copy has no sharp edges
        frame = FrameMap(captured_body.mesh, centers, group.affinity, group.spacing, settings.mapping)
        mapped = frame.to(aligned.targets)
        whole = frame.whole(mapped)
    return AlignedFrame(aligned.targets, surface, aligned.before, aligned.after, frame_features(frame, mapped, whole))


def _for_alignment(body: CappedMesh) -> tuple[CappedMesh, np.ndarray | slice]:
    """A coarse copy of a dense body, and the triangles of the body that its own come from; of any other, the body itself and all."""
    if len(body.mesh.triangles) <= DENSE_TRIANGLES:
        return body, slice(None)
    mesh, kept = clustered(body.mesh, ALIGNED_VERTICES)
    return CappedMesh(mesh, body.holes[kept]), kept


def group_surface(frames: Iterable[AlignedFrame], anchor: int, lines: FrameFeatures, spacing: float) -> GroupSurface:
    """What counts of the aligned frames of a group.

    frames : read one after the other; together they would fill the memory.  anchor : index of the anchor frame among them.
    lines : the features of that frame.  spacing : s, scene units.
    """
    shared, surfaces = SharedFeatures(lines, spacing), []
    for index, frame in enumerate(frames):
        surfaces.append(frame.surface)
        if index != anchor:
            shared.add(frame.features)
    surfaces = counting(surfaces, anchor, spacing)
    points, normals, on_cap = (np.concatenate([getattr(one, name) for one in surfaces]) for name in ("points", "normals", "on_cap"))
    return GroupSurface(points, normals, on_cap, shared.lines)


def with_features(reference: ReferenceMesh, surface: GroupSurface) -> ReferenceMesh:
    """The reference mesh with edges along the features of its group, and with its caps."""
    if len(surface.features.edges):
        laid = with_feature_edges(reference.mesh, surface.features.mesh, surface.features.edges)
        reference = ReferenceMesh(laid.mesh, laid.crossing, laid.features)
    if not surface.on_cap.any():
        return reference
    nearest = cKDTree(surface.points).query(reference.mesh.vertices)[1]
    return replace(reference, caps=np.flatnonzero(surface.on_cap[nearest]).astype(np.int32))


def build_reference(
    points: np.ndarray,
    normals: np.ndarray,
    spacing: float,
    triangles: int,
    depth: int,
    reconstruct: Callable[[np.ndarray, np.ndarray, int], TriangleMesh] = screened_poisson,
) -> ReferenceMesh:
    """The reference mesh of a group.

    points, normals : (P, 3) of all its aligned frames.  spacing : s, scene units.  triangles : budget.
    depth : of the octree.  reconstruct : gives a closed surface for points, normals and depth, as `screened_poisson` does.
    Raises RefMeshError when no component of that surface lies near the points.
    """
    surface = without_bubbles(reconstruct(points, normals, depth), points, spacing)
    if not len(surface.triangles):
        raise RefMeshError(
            "the reconstruction gives no surface near the aligned frames; check that the frames show one body, bring it near the origin, "
            "or take a higher resolution"
        )
    mesh = remeshed(surface, triangles)
    return ReferenceMesh(mesh, int(crossing_triangles(mesh).sum()))
