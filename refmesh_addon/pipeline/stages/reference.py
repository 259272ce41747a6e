"""The reference stage: the frames of each group aligned in reference positions, and one mesh for each group."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np

from ...core.capture.openness import OPEN, SIDES
from ...core.latest import latest_only
from ...core.reference.alignment import AnchorFrame
from ...core.reference.budget import ALIGNED_VERTICES, DENSE_TRIANGLES, MAX_TRIANGLES, is_capped, points_per_frame, triangle_budget
from ...core.reference.cap_points import counting
from ...core.reference.capture_density import CaptureDensity
from ...core.reference.group import (
    AlignedFrame,
    GroupCenters,
    GroupTracks,
    ReferenceMesh,
    align_frame,
    anchor_frame,
    group_surface,
    place_centers,
)
from ...core.reference.own_mesh import carried_to_reference, placed_in_reference
from ...core.reference.union_points import UnionPoints
from ...core.settings import ReferenceSettings
from ...core.surfacing.hole_caps import CappedMesh, without_holes
from ...core.surfacing.reconstruction import cell_size, reconstruction_depth
from ...core.types import Keyed
from ..session.cache import digest
from ..session.cached_map import WorkUnit, cached_map
from ..session.context import Context
from ..session.job import REFERENCE
from ..session.stage_share import StageShare
from .groups import FrameGroup
from .open_reference import MOST_SHARING, anchor_penalty, build_open_with, union_of
from .own_mesh import over_reference, own_mesh, own_mesh_frame, own_mesh_key
from .reconstruction import build_with
from .tracking_result import TrackingResult
from .transients import ExtendedMeshes, GroupTransients, group_transients

REFERENCE_SCHEMA = 19
OPEN_REFERENCE_SCHEMA = 3  # of what is done differently for open takes
SEGMENT_SCHEMA = 1  # of what is done differently for the frames of a segment
# Parts of the stage's time, roughly.
PLACING = StageShare(REFERENCE, 0.0, 0.1)
ALIGNING = StageShare(REFERENCE, 0.1, 0.7)
BUILDING = StageShare(REFERENCE, 0.7, 1.0)
# Settings that a group's mesh depends on through its frames, and through the bodies that the centers belong to, only.
INDIRECT = ("group_size", "longest_group", "group_starts", "apart", "segments", "segment_frames", "mesh", "mesh_frame")


@dataclass(frozen=True)
class GroupedFrames:
    """The groups of a sequence.  bodies : (C,) that must be apart, or None."""

    groups: tuple[FrameGroup, ...]
    bodies: np.ndarray | None


@dataclass(frozen=True)
class AlignedGroups(GroupedFrames):
    """The groups of a sequence and their frames in reference positions, read from the cache on access.

    centers : by index of the group.  aligned : by index of the group and index of the frame, hand-overs included. A frame that a mesh
    is made from and that no group with that mesh reaches is under the first of these.
    """

    centers: Mapping[int, GroupCenters]
    aligned: Mapping[tuple[int, int], AlignedFrame]

    def of_source(self, group: FrameGroup, frame: int) -> AlignedFrame:
        """One of the frames that the mesh of a group is made from."""
        return self.aligned[self.holder(group, frame), frame]

    def holder(self, group: FrameGroup, frame: int) -> int:
        """Index of the group, of all with the mesh of `group`, under which a frame that the mesh is made from is."""
        return next(one.index for one in self.groups if one.key == group.key and (one.index, frame) in self.aligned)


@dataclass(frozen=True)
class References(AlignedGroups):
    """The same with the reference mesh of each group.

    meshes : by index of the group.  transients : by index of each group that has any.
    """

    meshes: Mapping[int, ReferenceMesh]
    transients: Mapping[int, GroupTransients]

    @property
    def extended(self) -> Mapping[int, ReferenceMesh]:
        """The meshes with the transient pieces of their frames, as they are written, played and measured."""
        return ExtendedMeshes(self.meshes, self.transients)


@dataclass(frozen=True, eq=False)
class GroupAnchor(Keyed):
    """What all frames of a group are aligned with.

    body : the anchor frame's.  tracked : (C, 3) centers in that frame.  centers : what the frames of the group share.
    surface : (T,) bool, which triangles of an open take's frame show something; None for closed bodies.
    """

    key: str
    body: CappedMesh
    tracked: np.ndarray
    centers: GroupCenters
    settings: ReferenceSettings
    surface: np.ndarray | None = None


def make_references(context: Context, tracking: TrackingResult, grouped: GroupedFrames) -> References:
    """The reference mesh of each group."""
    aligned = align_groups(context, tracking, grouped)
    units, own = building_units(context, tracking, aligned), _carrying_units(context, tracking, aligned)
    build = build_with if context.frames.take is None and context.settings.reference.holes == "closed" else build_open_with
    built = cached_map(context, build, {index: unit for index, unit in units.items() if index not in own}, ReferenceMesh, BUILDING)
    place = placed_in_reference if over_reference(context) else carried_to_reference
    carried = cached_map(context, place, own, ReferenceMesh, BUILDING)
    meshes = ChainMap(carried, built)  # type: ignore[arg-type]  # which never writes to them
    theirs = {group.index: group_transients(context, group, _budget(context, group)) for group in aligned.groups if group.index not in own}
    return References(**vars(aligned), meshes=meshes, transients={index: pieces for index, pieces in theirs.items() if pieces})


def align_groups(context: Context, tracking: TrackingResult, grouped: GroupedFrames) -> AlignedGroups:
    """All frames in the reference positions of their groups."""
    groups = grouped.groups
    placed = {group.index: _placing(context, tracking, group, grouped.bodies) for group in groups}
    centers = cached_map(context, place_centers, placed, GroupCenters, PLACING)
    points = {group.key: _points(context, group) for group in groups}
    pairs = _aligned_frames(groups)
    units = {(group.index, frame): _alignment(context, tracking, (group, frame), centers, points[group.key]) for group, frame in pairs}
    return AlignedGroups(groups, grouped.bodies, centers, cached_map(context, align_to_anchor, units, AlignedFrame, ALIGNING))


def _aligned_frames(groups: tuple[FrameGroup, ...]) -> list[tuple[FrameGroup, int]]:
    """What each group reaches, then what a mesh is made from beyond that, once for all groups that have this mesh."""
    pairs = [(group, frame) for group in groups for frame in group.reached]
    reached = {(group.key, frame) for group, frame in pairs}
    first = {group.key: group for group in reversed(groups)}
    return pairs + [(group, frame) for key, group in first.items() for frame in group.source if (key, frame) not in reached]


def group_frames(
    context: Context,
    tracking: TrackingResult,
    bodies: np.ndarray | None,
    runs: list[tuple[int, ...]],
    sources: list[tuple[int, ...]] | None = None,
    **kind: object,
) -> GroupedFrames:
    """Runs of frames, as indices in order, as groups.

    bodies : (C,) that must be apart, or None.  sources : frames that each mesh is made from, None for those of each run.
    kind : `segment` and `folder` of all the groups.
    """
    sources = sources or runs
    settings = {name: value for name, value in asdict(context.settings.reference).items() if name not in INDIRECT}
    more = [OPEN_REFERENCE_SCHEMA] if context.frames.take is not None else []
    more += ([] if bodies is None else [bodies.tolist()]) + ([SEGMENT_SCHEMA] if kind.get("segment") else [])
    own = {frame: own_mesh_key(context) for frame in [own_mesh_frame(context)] if frame is not None}
    handovers = [following[0] for following in runs[1:]] + [None]
    parts = [[*more, *(key for frame, key in own.items() if frame in frames), *_cap(context, frames)] for frames in sources]
    ranges = [tracking.range_of(frames[0]).key for frames in sources]
    keys = [digest(REFERENCE_SCHEMA, *item[:2], settings, *item[2]) for item in zip(ranges, sources, parts, strict=True)]
    rows = enumerate(zip(runs, handovers, keys, sources, strict=True))
    return GroupedFrames(tuple(FrameGroup(index, *row, **kind) for index, row in rows), bodies)


def _cap(context: Context, frames: tuple[int, ...]) -> list[int]:
    """What is done differently for dense frames; that groups without any have the keys of earlier versions spares their work."""
    capped = is_capped(context.settings.reference.triangles, [context.frames.counts[frame] for frame in frames])
    dense = max(context.frames.counts) > DENSE_TRIANGLES
    return [MAX_TRIANGLES] * capped + [DENSE_TRIANGLES, ALIGNED_VERTICES] * dense


def building_units(context: Context, tracking: TrackingResult, aligned: AlignedGroups) -> dict[int, WorkUnit]:
    """What `build_with` is to do, by index of the group."""
    return {group.index: _building(context, tracking, group, aligned) for group in aligned.groups}


def align_to_anchor(body: CappedMesh, tracked: np.ndarray, anchor: GroupAnchor, count: int) -> AlignedFrame:
    """`align_frame`, with an anchor frame that is built anew only where the last call in this process was for another group."""
    return align_frame(body, tracked, _anchor_frame(anchor), anchor.centers, anchor.settings, count)


@latest_only
def _anchor_frame(anchor: GroupAnchor) -> AnchorFrame:
    return anchor_frame(anchor.body, anchor.tracked, anchor.centers, anchor.settings, anchor.surface)


def counts_for_the_surface(context: Context, aligned: AlignedFrame) -> bool:
    """Whether a frame lies near enough to the anchor frame to count for the surface; the anchor frame itself always does."""
    if context.frames.take is not None:  # the overlap of thin layers says little, and each frame may show what no other does
        return True
    return aligned.iou_after >= context.settings.reference.least_overlap


def _placing(context: Context, tracking: TrackingResult, group: FrameGroup, bodies: np.ndarray | None) -> WorkUnit:
    def arguments() -> tuple:
        first = group.source[0]
        positions, settings = tracking.centers_in(group.source), context.settings.reference
        own = None if bodies is None else bodies[tracking.members(group.source)]
        penalty = anchor_penalty(context, group.source)
        tracks = GroupTracks(positions, tracking.affinity_at(group.source), tracking.range_of(first).spacing, penalty)
        return tracks, settings, own, group.segment

    return WorkUnit(_source_entry(context, group, "centers"), group.key, arguments, context.numbers[group.source[0]])


def _source_entry(context: Context, group: FrameGroup, name: str) -> str:
    """In the cache, of what all groups with the same mesh share; a number that other cuts before it do not change."""
    return f"{group.folder}reference/{name}_{context.numbers[group.source[0]]:04d}"


def _points(context: Context, group: FrameGroup) -> int:
    """That each frame of a group contributes to its mesh."""
    sharing = len(group.source) if context.frames.take is None else min(len(group.source), MOST_SHARING)
    return points_per_frame(_budget(context, group), sharing)


def _alignment(
    context: Context, tracking: TrackingResult, pair: tuple[FrameGroup, int], centers: Mapping[int, GroupCenters], points: int
) -> WorkUnit:
    """points : that the frame contributes to the mesh of its group."""
    group, frame = pair

    def arguments() -> tuple:
        own = centers[group.index]
        anchor = group.source[own.anchor]
        anchor_centers, frame_centers = tracking.centers_in((anchor, frame), group.source)
        frames, take = context.frames, context.frames.take
        anchored = frames.capped(anchor) if take is None else without_holes(frames.body(anchor))  # no hole of it is closed once for all
        surface = frames.capped(anchor).holes < 0 if frames.kind == OPEN else None
        shared = GroupAnchor(group.key, anchored, anchor_centers, own, context.settings.reference, surface)
        return frames.capped(frame), frame_centers, shared, points

    number = context.numbers[frame]
    entry = f"reference/handover_{context.numbers[group.frames[0]]:04d}" if frame == group.handover else f"reference/aligned_{number:04d}"
    return WorkUnit(group.folder + entry, group.key, arguments, number)


def _building(context: Context, tracking: TrackingResult, group: FrameGroup, groups: AlignedGroups) -> WorkUnit:
    def arguments() -> tuple:
        centers = groups.centers[group.index]
        anchor = context.frames.body(group.source[centers.anchor])
        settings, triangles = context.settings.reference, _budget(context, group)
        depth = settings.poisson_depth or reconstruction_depth(anchor, triangles)
        if context.frames.take is not None:
            surfaces = (groups.of_source(group, frame).surface for frame in group.source)
            union = union_of(surfaces, cell_size(anchor.vertices, depth) / 2)
            is_open = context.frames.kind == OPEN  # half of a shell is cut away again
            return settings.reconstruction, union, centers.spacing, 2 * triangles if is_open else triangles, depth, is_open
        kept = [frame for frame in group.source if counts_for_the_surface(context, groups.of_source(group, frame))]
        own = group.source[centers.anchor]
        frames, anchor = (groups.of_source(group, frame) for frame in kept), kept.index(own)
        if settings.holes == "open":
            surfaces = counting([frame.surface for frame in frames], anchor, centers.spacing)
            points, normals, on_cap = (np.concatenate([getattr(one, name) for one in surfaces]) for name in ("points", "normals", "on_cap"))
            return settings.reconstruction, UnionPoints(points, normals, ~on_cap), centers.spacing, triangles, depth, True
        surface = group_surface(frames, anchor, groups.of_source(group, own).features, centers.spacing)
        return settings.reconstruction, surface, centers.spacing, triangles, depth, _density(context, tracking, group, centers)

    return WorkUnit(_source_entry(context, group, "mesh"), group.key, arguments)


def _density(context: Context, tracking: TrackingResult, group: FrameGroup, centers: GroupCenters) -> CaptureDensity | None:
    """That of the group's anchor frame; None where the number of triangles is requested, or as large as we allow."""
    settings = context.settings.reference
    if settings.triangles or settings.mapping == "rbf" or _cap(context, group.source):
        return None
    anchor = group.source[centers.anchor]
    return CaptureDensity.of(context.frames.surface(anchor), tracking.centers_in((anchor,), group.source)[0], centers.positions)


def _carrying_units(context: Context, tracking: TrackingResult, aligned: AlignedGroups) -> dict[int, WorkUnit]:
    """What `carried_to_reference` or `placed_in_reference` is to do, for the group that a mesh of the user's own was made for, if any."""
    frame = own_mesh_frame(context)
    return {group.index: _carrying(context, tracking, group, frame, aligned) for group in aligned.groups if frame in group.source}


def _carrying(context: Context, tracking: TrackingResult, group: FrameGroup, frame: int, aligned: AlignedGroups) -> WorkUnit:
    def arguments() -> tuple:
        if over_reference(context):
            anchor = aligned.of_source(group, group.source[aligned.centers[group.index].anchor])
            return own_mesh(context), anchor.surface.points, anchor.surface.normals
        targets, mapping = aligned.of_source(group, frame).targets, context.settings.reference.mapping
        return own_mesh(context), tracking.centers_in((frame,), group.source)[0], targets, aligned.centers[group.index], mapping

    return WorkUnit(_source_entry(context, group, "mesh"), group.key, arguments)


def _budget(context: Context, group: FrameGroup) -> int:
    frames, requested = context.frames, context.settings.reference.triangles
    needed = [frames.statistics[frame].needed_triangles for frame in group.source]
    return triangle_budget(requested, [frames.counts[frame] for frame in group.source], needed, SIDES[frames.kind])
