"""Reference meshes with more triangles where the frames of a run stretch them, from the frames that its review has probed."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...core.deformation.deformer import DeformedFrame
from ...core.errors import RefMeshError
from ...core.reference.frame_lengths import with_frame_lengths
from ...core.reference.group import ReferenceMesh
from ...core.reference.refinement import FittedFrame, refined
from ..session.cache import digest
from ..session.cached_map import CachedResults, WorkUnit
from ..session.context import Context
from .deformation import fit_frames, fitting_groups
from .groups import FrameGroup
from .reference import References
from .segment_trials import SegmentTrials
from .tracking_result import TrackingResult

REFINEMENT_SCHEMA = 4


@dataclass(frozen=True)
class _FittedFrames:
    """Read from the cache each time they are looked at: one in eight of a long take would fill the memory."""

    fitted: Mapping[tuple[int, int], DeformedFrame]

    def __iter__(self) -> Iterator[FittedFrame]:
        return (FittedFrame(frame.vertices, ~(frame.held | frame.hidden)) for frame in self.fitted.values())


def refine(context: Context, tracking: TrackingResult, references: References) -> References:
    """The references with refined meshes, where how many triangles they have is not the user's choice. Those of open takes stay, because
    what stretches there is mostly out of view.

    One frame in eight is fitted for this, or was by the review; these are fitted again where the mesh changes.
    Raises RefMeshError where another process has to do this first.
    """
    settings = context.settings.reference
    if settings.triangles or settings.mesh or context.frames.take is not None:
        return references
    trials, units = SegmentTrials(context, tracking, references.bodies), {}
    for group in fitting_groups(context, references):
        source = references.groups[group.index]
        if source.key not in units:
            units[source.key] = _refinement(context, tracking, references, source, group.key, trials.probes(group.source))
    changed = {group.index: unit for group in references.groups if (unit := units[group.key]) is not None}
    groups = tuple(replace(group, key=changed[group.index].key) if group.index in changed else group for group in references.groups)
    meshes = ChainMap(CachedResults(context.cache, changed, ReferenceMesh), references.meshes)  # type: ignore[arg-type]  # never written to
    return replace(references, groups=groups, meshes=meshes)


def _refinement(
    context: Context, tracking: TrackingResult, references: References, group: FrameGroup, fitting_key: str, frames: tuple[int, ...]
) -> WorkUnit | None:
    """Where the refined mesh of all groups that share that of `group` is in the cache; None where it is the same mesh.

    fitting_key : of all that the frames depend on once they are fitted.  frames : that are looked at.
    """
    reference, key = references.meshes[group.index], digest(REFINEMENT_SCHEMA, fitting_key, frames)
    entry = f"{group.folder}reference/refined_{context.numbers[group.source[0]]:04d}"
    mesh = context.cache.load_result(entry, key, ReferenceMesh)
    if mesh is None:
        if context.part is not None:
            raise RefMeshError("an earlier step of the job is not complete: run its tasks first")
        fitted = fit_frames(context.without_progress(), tracking, references, _holders(references, group, frames))
        mesh = _adapted(reference, _FittedFrames(fitted))
        context.cache.save_result(entry, key, mesh)
    return None if np.array_equal(mesh.mesh.vertices, reference.mesh.vertices) else WorkUnit(entry, key, tuple)


def _adapted(reference: ReferenceMesh, frames: _FittedFrames) -> ReferenceMesh:
    """The reference mesh with edges as long as frames show them, and those divided that are too long."""
    mesh = with_frame_lengths(reference.mesh, frames)
    return refined(replace(reference, mesh=mesh), frames, reference.mesh.vertices)


def _holders(references: References, group: FrameGroup, frames: tuple[int, ...]) -> Mapping[int, tuple[int, ...]]:
    """Of groups that share a mesh, by index, which of some frames each has in reference positions; each frame once."""
    holders: dict[int, tuple[int, ...]] = {}
    for frame in frames:
        index = references.holder(group, frame)
        holders[index] = (*holders.get(index, ()), frame)
    return holders
