"""The deformation stage: each group's reference mesh in each of its frames, smoothed over time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Annotated

import numpy as np

from ...core.capture.openness import OPEN
from ...core.deformation.deformer import DeformedFrame, GroupReference, deform_reference
from ...core.deformation.facing import Facing
from ...core.deformation.fold_free_moves import moved_without_folds
from ...core.deformation.presence import shrunk
from ...core.deformation.temporal_smoothing import smoothed_in_time
from ...core.reference.group import ReferenceMesh
from ...core.settings import Settings
from ...core.types import FrozenArrays, TriangleMesh
from ..session.cache import digest
from ..session.cached_map import CachedResults, WorkUnit, cached_map, finished_units
from ..session.context import Context
from ..session.job import DEFORMATION
from ..session.stage_share import StageShare
from .drift import FITTING, SLIDING, Fitted, drift_removal
from .drift_units import UndriftedFrame, remove_drift
from .groups import FrameGroup
from .reference import References
from .tracking_result import TrackingResult
from .transients import GroupTransients

DEFORMATION_SCHEMA = 18
SMOOTHING_SCHEMA = 3
VIEW_SCHEMA = 3  # of what is done differently for open takes
BLOCK = 10  # frames of a run that are smoothed together; the first has a multiple of it as index, wherever the run begins
# Parts of the stage's time, roughly.
DEFORMING = StageShare(DEFORMATION, 0.0, 0.95)
SMOOTHING = StageShare(DEFORMATION, 0.95, 1.0)
UNCOUNTED = StageShare(DEFORMATION, 0.0, 0.0)  # of smoothing that is done while other groups are deformed


@dataclass(frozen=True)
class SmoothedFrame(FrozenArrays):
    """One row of `SmoothedBlock`."""

    vertices: np.ndarray
    velocities: np.ndarray
    flipped: float
    held: float
    hidden: float
    absent: float


@dataclass(frozen=True)
class SmoothedBlock(FrozenArrays):
    """The reference mesh of a group in successive frames that it reaches, its hand-over last.

    vertices : (F, R, 3) scene units.  velocities : (F, R, 3) float32, scene units per frame.
    flipped : (F,) share of triangles that face against their surroundings and against the source.
    held : (F,) share of vertices that no point of the source pulled.  hidden : (F,) share of vertices that lie in a contact.
    absent : (F,) share of vertices of bodies that the frame does not show, which are in one point.
    """

    vertices: Annotated[np.ndarray, "(F, R, 3) float64"]
    velocities: Annotated[np.ndarray, "(F, R, 3) float32"]
    flipped: Annotated[np.ndarray, "(F) float64"]
    held: Annotated[np.ndarray, "(F) float64"]
    hidden: Annotated[np.ndarray, "(F) float64"]
    absent: Annotated[np.ndarray, "(F) float64"]


@dataclass(frozen=True)
class DeformedSequence:
    """The mesh of every frame, read from the cache on demand.

    groups : with keys of all that their deformed meshes depend on.  references : by index of the group, with transient pieces.
    smoothed : by index of the group and of the block, as `blocks` divides its frames.  transients : by index of the group.
    block_keys : of all that each block depends on.  undrifted : by (group, frame), where drift was removed; empty where it was not.
    """

    groups: tuple[FrameGroup, ...]
    references: Mapping[int, ReferenceMesh]
    smoothed: Mapping[tuple[int, int], SmoothedBlock]
    transients: Mapping[int, GroupTransients]
    block_keys: Mapping[tuple[int, int], str]
    undrifted: Mapping[tuple[int, int], UndriftedFrame] = field(default_factory=dict)
    _anchors: dict[int, np.ndarray] = field(default_factory=dict)

    def mesh(self, group: FrameGroup, frame: int) -> TriangleMesh:
        """The reference mesh of a group in a frame that it reaches, by index."""
        return self.references[group.index].mesh.moved(self.row(group, group.reached.index(frame)).vertices)

    def frame_key(self, group: FrameGroup, frame: int) -> str:
        """Of all that the mesh of a frame depends on: cuts far from it change nothing."""
        key = self.block_keys[group.index, block_of(group, group.reached.index(frame))[0]]
        return digest(key, group.frames) if group.index in self.transients else key

    def row(self, group: FrameGroup, row: int) -> SmoothedFrame:
        """One of the frames that a group reaches, by its position among them."""
        frame, transients = self._bare_row(group, row), self.transients.get(group.index)
        if transients is None:
            return frame
        if group.index not in self._anchors:
            self._anchors[group.index] = self._anchored(group, transients)
        vertices = transients.placed(frame.vertices, group.reached[row], self._anchors[group.index])
        still = np.zeros((len(transients.piece), 3), frame.velocities.dtype)
        return replace(frame, vertices=vertices, velocities=np.concatenate([frame.velocities, still]))

    def without_pieces(self, group: FrameGroup, vertices: np.ndarray) -> np.ndarray:
        """(R, 3) vertices of a group's mesh with its transient pieces shrunk to a point, as in a frame that has none. vertices : (R, 3)."""
        transients = self.transients.get(group.index)
        if transients is None:
            return vertices
        return transients.placed(vertices[: -len(transients.piece)], -1, self._anchors[group.index])

    def _anchored(self, group: FrameGroup, transients: GroupTransients) -> np.ndarray:
        """(V,) vertices of the reference mesh to which those of transient pieces shrink."""
        nearest: dict[int, int] = {}
        for frame in np.unique(transients.frame).tolist():
            nearest |= transients.nearest(self._bare_row(group, group.frames.index(frame)).vertices, frame)
        return np.array([nearest[piece] for piece in range(len(nearest))])[transients.piece]

    def _bare_row(self, group: FrameGroup, row: int) -> SmoothedFrame:
        index, start = block_of(group, row)
        block = self.smoothed[group.index, index]
        shares = (float(getattr(block, name)[row - start]) for name in ("flipped", "held", "hidden", "absent"))
        return SmoothedFrame(block.vertices[row - start], block.velocities[row - start], *shares)


def deform(
    context: Context,
    tracking: TrackingResult,
    references: References,
    ready: Callable[[DeformedSequence, FrameGroup], None] | None = None,
) -> DeformedSequence:
    """The reference meshes in all frames and hand-overs.

    ready : called for each group as soon as its frames are done, with a sequence from which that group can be read.
    """
    work = _work(context, tracking, references)
    fitted = CachedResults(context.cache, work.units, work.kind)
    smooth_groups = tuple(replace(group, key=_smoothing_key(context, group)) for group in work.groups)
    parts = [(group, index, block) for group in smooth_groups for index, block in enumerate(blocks(group))]
    smoothing = {
        (group.index, index): _smoothing(context, references, fitted, work.groups[group.index], block) for group, index, block in parts
    }
    keys = {name: unit.key for name, unit in smoothing.items()}
    names = {group.index: [(group.index, block) for block in range(len(blocks(group)))] for group in smooth_groups}
    removed = fitted if work.kind is UndriftedFrame else {}
    sequence = lambda smoothed: DeformedSequence(smooth_groups, references.extended, smoothed, references.transients, keys, removed)
    remaining = {group.index: set(group.reached) for group in smooth_groups}
    for index, frame in finished_units(context, work.function, work.units, work.kind, work.share):
        remaining[index].discard(frame)
        if ready is not None and not remaining[index]:
            own = {name: smoothing[name] for name in names[index]}
            done = cached_map(context, smooth_block, own, SmoothedBlock, UNCOUNTED)
            ready(sequence(done), smooth_groups[index])
    return sequence(cached_map(context, smooth_block, smoothing, SmoothedBlock, SMOOTHING))


@dataclass(frozen=True)
class _Work:
    """How the frames come about that are then smoothed: `function` computes results of type `kind`, `units` by group and frame."""

    groups: list[FrameGroup]
    units: dict[tuple[int, int], WorkUnit]
    function: Callable[..., DeformedFrame]
    kind: type[DeformedFrame]
    share: StageShare


def _work(context: Context, tracking: TrackingResult, references: References) -> _Work:
    """Fitting alone, or, once that is done, the removal of drift."""
    groups = fitting_groups(context, references)
    pairs = [(group, frame) for group in groups for frame in group.reached]
    units = {(group.index, frame): _fitting(context, tracking, references, group, frame) for group, frame in pairs}
    plain = _Work(groups, units, deform_reference, DeformedFrame, fitting_share(context.settings))
    if context.settings.color.color_drift == "off":
        return plain
    fitted = cached_map(context, deform_reference, units, DeformedFrame, plain.share)
    removal = drift_removal(context, references, groups, Fitted(units, fitted))
    return plain if removal is None else _Work(removal.groups, removal.units, remove_drift, UndriftedFrame, SLIDING)


def fitting_share(settings: Settings) -> StageShare:
    """The part of the stage's progress in which frames are fitted."""
    return DEFORMING if settings.color.color_drift == "off" else FITTING


def fitting_groups(context: Context, references: References) -> list[FrameGroup]:
    """The groups with keys of their frames before these are smoothed, which is done on many frames of a group together."""
    settings = replace(context.settings.deformation, steady_frames=0)
    more = [] if context.frames.take is None else [VIEW_SCHEMA]
    return [replace(group, key=digest(DEFORMATION_SCHEMA, group.key, asdict(settings), *more)) for group in references.groups]


def fit_frames(
    context: Context, tracking: TrackingResult, references: References, frames: Mapping[int, tuple[int, ...]]
) -> CachedResults[tuple[int, int], DeformedFrame]:
    """Some frames of each group before they are smoothed, by index of the group and of the frame; `deform` goes on from there."""
    groups = fitting_groups(context, references)
    pairs = [(groups[index], frame) for index, chosen in frames.items() for frame in chosen]
    units = {(group.index, frame): _fitting(context, tracking, references, group, frame) for group, frame in pairs}
    return cached_map(context, deform_reference, units, DeformedFrame, fitting_share(context.settings))


def blocks(group: FrameGroup) -> list[tuple[int, int]]:
    """Start and end of the blocks in which the frames that a group reaches are smoothed: all at once, or so that a run fits any memory."""
    count, first = len(group.reached), group.reached[0]
    starts = [0, *(row for row in range(1, count) if (first + row) % BLOCK == 0)] if group.segment else [0]
    return list(zip(starts, [*starts[1:], count], strict=True))


def block_of(group: FrameGroup, row: int) -> tuple[int, int]:
    """Index and start of the block that holds one of the frames that a group reaches, by its position among them."""
    if not group.segment:
        return 0, 0
    first = group.reached[0]
    index = (first + row) // BLOCK - first // BLOCK
    return index, max((first // BLOCK + index) * BLOCK - first, 0)


def smooth_block(
    mesh: TriangleMesh,
    fitted: list[DeformedFrame],
    times: np.ndarray,
    steady_frames: int,
    needed: slice = slice(None),
    own: slice = slice(None),
) -> SmoothedBlock:
    """Frames, each fitted by itself, brought to rest along the surface without new folds.

    mesh : the reference.  times : (F,) number of each frame.  steady_frames : how many to either side have a say.
    needed : those of the frames that velocities depend on; the others only have a say.  own : those of `needed` that are the block's.
    """
    vertices = np.stack([frame.vertices for frame in fitted])
    goals = smoothed_in_time(mesh, vertices, times, steady_frames, needed)
    fitted, vertices, times = fitted[needed], vertices[needed], times[needed]
    facings = [Facing(mesh, frame.rotations) for frame in fitted]
    placed = np.stack([moved_without_folds(*moves) for moves in zip(facings, vertices, goals, strict=True)])
    velocities = np.gradient(placed, times, axis=0) if len(times) > 1 else np.zeros_like(placed)
    flipped = [np.mean(facing.folded(there) & ~frame.curled) for facing, there, frame in zip(facings, placed, fitted, strict=True)]
    placed = np.stack([shrunk(there, mesh, frame.absent) for there, frame in zip(placed, fitted, strict=True)])
    velocities[np.stack([frame.absent for frame in fitted])] = 0.0
    rest = ([np.mean(getattr(frame, name)) for frame in fitted] for name in ("held", "hidden", "absent"))
    return SmoothedBlock(placed[own], velocities.astype(np.float32)[own], *(np.array(shares)[own] for shares in (flipped, *rest)))


def _fitting(context: Context, tracking: TrackingResult, references: References, group: FrameGroup, frame: int) -> WorkUnit:
    settings = replace(context.settings.deformation, steady_frames=0)

    def arguments() -> tuple:
        reference, centers = references.meshes[group.index], references.centers[group.index]
        mapping, is_open, is_view = context.settings.reference.mapping, context.frames.kind == OPEN, context.frames.take is not None
        shared = GroupReference(group.key, reference.mesh, centers, settings, mapping, is_open, is_view, reference.features, reference.caps)
        targets = references.aligned[group.index, frame].targets
        return shared, targets, context.frames.surface(frame), tracking.centers_in((frame,), group.source)[0]

    number = context.numbers[frame]
    first = context.numbers[group.frames[0]]
    entry = f"deformation/handover_{first:04d}" if frame == group.handover else f"deformation/frame_{number:04d}"
    return WorkUnit(group.folder + entry, group.key, arguments, number)


def _smoothing_key(context: Context, group: FrameGroup) -> str:
    """Of all frames of a group together."""
    times = [context.numbers[frame] for frame in group.reached]
    return digest(SMOOTHING_SCHEMA, group.key, times, context.settings.deformation.steady_frames)


def smoothing_rows(block: tuple[int, int], count: int, steady_frames: int) -> tuple[slice, slice, slice]:
    """The frames that a block's smoothing reads, of `count`; of these, the ones that it needs smoothed; and of these, its own."""
    first, last = max(block[0] - 1, 0), min(block[1] + 1, count)  # velocities look one frame to either side
    start, end = max(first - 2 * steady_frames, 0), min(last + 2 * steady_frames, count)  # the filter is as wide there as in the whole run
    return slice(start, end), slice(first - start, last - start), slice(block[0] - first, block[1] - first)


def _smoothing(
    context: Context, references: References, fitted: Mapping[tuple[int, int], DeformedFrame], group: FrameGroup, block: tuple[int, int]
) -> WorkUnit:
    steady = context.settings.deformation.steady_frames
    window, needed, own = smoothing_rows(block, len(group.reached), steady)
    times = [context.numbers[frame] for frame in group.reached[window]]

    def arguments() -> tuple:
        frames = [fitted[group.index, frame] for frame in group.reached[window]]
        return references.meshes[group.index].mesh, frames, np.array(times), steady, needed, own

    key = digest(SMOOTHING_SCHEMA, group.key, times, repr((needed, own)), steady)
    name = f"smoothed_{context.numbers[group.frames[0]]:04d}_{context.numbers[group.reached[block[0]]]:04d}"
    return WorkUnit(f"{group.folder}deformation/{name}", key, arguments)
