"""The deformation stage: each group's reference mesh in each of its frames, smoothed over time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from ...core.deformation.deformer import DeformedFrame, GroupReference, deform_reference
from ...core.deformation.facing import Facing
from ...core.deformation.fold_free_moves import moved_without_folds
from ...core.deformation.temporal_smoothing import smoothed_in_time
from ...core.reference.group import ReferenceMesh
from ...core.types import FrozenArrays, TriangleMesh
from ..session.cache import digest
from ..session.cached_map import CachedResults, WorkUnit, cached_map, finished_units
from ..session.context import Context
from ..session.job import DEFORMATION
from ..session.session import StageShare
from .groups import FrameGroup
from .reference import References
from .tracking_result import TrackingResult

DEFORMATION_SCHEMA = 9
SMOOTHING_SCHEMA = 1
# Parts of the stage's time, roughly.
DEFORMING = StageShare(DEFORMATION, 0.0, 0.95)
SMOOTHING = StageShare(DEFORMATION, 0.95, 1.0)
UNCOUNTED = StageShare(DEFORMATION, 0.0, 0.0)  # of smoothing that is done while other groups are deformed


@dataclass(frozen=True)
class SmoothedGroup(FrozenArrays):
    """The reference mesh of a group in all frames that it reaches, its hand-over last.

    vertices : (F, R, 3) scene units.  velocities : (F, R, 3) float32, scene units per frame.
    flipped : (F,) share of triangles that face against their surroundings and against the source.
    held : (F,) share of vertices that no point of the source pulled.  hidden : (F,) share of vertices that lie in a contact.
    """

    vertices: np.ndarray
    velocities: np.ndarray
    flipped: np.ndarray
    held: np.ndarray
    hidden: np.ndarray


@dataclass(frozen=True)
class DeformedSequence:
    """The mesh of every frame, read from the cache on demand.

    groups : with keys of all that their deformed meshes depend on.  references, smoothed : by index of the group.
    """

    groups: tuple[FrameGroup, ...]
    references: Mapping[int, ReferenceMesh]
    smoothed: Mapping[int, SmoothedGroup]

    def mesh(self, group: FrameGroup, frame: int) -> TriangleMesh:
        """The reference mesh of a group in a frame that it reaches, by index."""
        vertices = self.smoothed[group.index].vertices[group.reached.index(frame)]
        return self.references[group.index].mesh.moved(vertices)


def deform(
    context: Context,
    tracking: TrackingResult,
    references: References,
    ready: Callable[[DeformedSequence, FrameGroup], None] | None = None,
) -> DeformedSequence:
    """The reference meshes in all frames and hand-overs.

    ready : called for each group as soon as its frames are done, with a sequence of which that group can be asked for.
    """
    settings = replace(context.settings.deformation, steady_frames=0)  # smoothing comes later, on all frames of a group
    groups = [replace(group, key=digest(DEFORMATION_SCHEMA, group.key, asdict(settings))) for group in references.groups]
    pairs = [(group, frame) for group in groups for frame in group.reached]
    units = {(group.index, frame): _fitting(context, tracking, references, group, frame) for group, frame in pairs}
    fitted = CachedResults(context.cache, units, DeformedFrame)
    smooth_groups = tuple(replace(group, key=_smoothing_key(context, group)) for group in groups)
    smoothing = {group.index: _smoothing(context, references, fitted, group) for group in smooth_groups}
    remaining = {group.index: set(group.reached) for group in smooth_groups}
    for index, frame in finished_units(context, deform_reference, units, DeformedFrame, DEFORMING):
        remaining[index].discard(frame)
        if ready is not None and not remaining[index]:
            own = cached_map(context, smooth_group, {index: smoothing[index]}, SmoothedGroup, UNCOUNTED)
            ready(DeformedSequence(smooth_groups, references.meshes, own), smooth_groups[index])
    smoothed = cached_map(context, smooth_group, smoothing, SmoothedGroup, SMOOTHING)
    return DeformedSequence(smooth_groups, references.meshes, smoothed)


def smooth_group(mesh: TriangleMesh, fitted: list[DeformedFrame], times: np.ndarray, steady_frames: int) -> SmoothedGroup:
    """A group's frames, each fitted by itself, brought to rest along the surface without new folds.

    mesh : the reference.  times : (F,) number of each frame.  steady_frames : how many to either side have a say.
    """
    vertices = np.stack([frame.vertices for frame in fitted])
    goals = smoothed_in_time(mesh, vertices, times, steady_frames)
    facings = [Facing(mesh, frame.rotations) for frame in fitted]
    placed = np.stack([moved_without_folds(*moves) for moves in zip(facings, vertices, goals, strict=True)])
    velocities = np.gradient(placed, times, axis=0) if len(times) > 1 else np.zeros_like(placed)
    flipped = [np.mean(facing.folded(own) & ~frame.curled) for facing, own, frame in zip(facings, placed, fitted, strict=True)]
    held, hidden = ([np.mean(getattr(frame, name)) for frame in fitted] for name in ("held", "hidden"))
    return SmoothedGroup(placed, velocities.astype(np.float32), np.array(flipped), np.array(held), np.array(hidden))


def _fitting(context: Context, tracking: TrackingResult, references: References, group: FrameGroup, frame: int) -> WorkUnit:
    settings = replace(context.settings.deformation, steady_frames=0)

    def arguments() -> tuple:
        mesh, centers = references.meshes[group.index].mesh, references.centers[group.index]
        shared = GroupReference(group.key, mesh, centers, settings, context.settings.reference.mapping)
        targets = references.aligned[group.index, frame].targets
        return shared, targets, context.frames.surface(frame), tracking.centers_in((group.frames[0], frame))[1]

    number = context.numbers[frame]
    entry = f"deformation/handover_{group.index:03d}" if frame == group.handover else f"deformation/frame_{number:04d}"
    return WorkUnit(group.folder + entry, group.key, arguments, number)


def _smoothing_key(context: Context, group: FrameGroup) -> str:
    times = [context.numbers[frame] for frame in group.reached]
    return digest(SMOOTHING_SCHEMA, group.key, times, context.settings.deformation.steady_frames)


def _smoothing(context: Context, references: References, fitted: Mapping[tuple[int, int], DeformedFrame], group: FrameGroup) -> WorkUnit:
    def arguments() -> tuple:
        frames = [fitted[group.index, frame] for frame in group.reached]
        times = np.array([context.numbers[frame] for frame in group.reached])
        return references.meshes[group.index].mesh, frames, times, context.settings.deformation.steady_frames

    return WorkUnit(f"{group.folder}deformation/group_{group.index:03d}", group.key, arguments)
