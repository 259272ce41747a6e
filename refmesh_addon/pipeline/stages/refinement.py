"""Reference meshes with more triangles where the frames of a run stretch them, from the frames that its review has probed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...core.errors import RefMeshError
from ...core.reference.group import ReferenceMesh
from ...core.reference.refinement import FittedFrame, refined
from ..session.cache import digest
from ..session.context import Context
from .deformation import fit_frames, fitting_groups
from .groups import FrameGroup
from .reference import References
from .segment_trials import SegmentTrials
from .tracking_result import TrackingResult

REFINEMENT_SCHEMA = 2


def refine(context: Context, tracking: TrackingResult, references: References) -> References:
    """The references with refined meshes, where how many triangles they have is not the user's choice.

    One frame in eight is fitted for this, or was by the review; all are fitted again where the mesh changes.
    Raises RefMeshError where another process has to do this first.
    """
    settings = context.settings.reference
    if settings.triangles or settings.mesh:
        return references
    meshes: dict[str, tuple[str, ReferenceMesh]] = {}
    for group in references.groups:
        if group.key not in meshes:
            meshes[group.key] = _refined(context, tracking, references, group)
    groups = tuple(replace(group, key=meshes[group.key][0]) for group in references.groups)
    return replace(references, groups=groups, meshes={group.index: meshes[group.key][1] for group in references.groups})


def _refined(context: Context, tracking: TrackingResult, references: References, group: FrameGroup) -> tuple[str, ReferenceMesh]:
    """The mesh of all groups that share that of `group`, and their key, which stays where the mesh does."""
    frames, reference = SegmentTrials(context, tracking, references.bodies).probes(group.source), references.meshes[group.index]
    key = digest(REFINEMENT_SCHEMA, fitting_groups(context, references)[group.index].key, frames)
    entry = f"{group.folder}reference/refined_{context.numbers[group.source[0]]:04d}"
    mesh = context.cache.load_result(entry, key, ReferenceMesh)
    if mesh is None:
        if context.part is not None:
            raise RefMeshError("an earlier step of the job is not complete: run its tasks first")
        fitted = fit_frames(context.without_progress(), tracking, references, _holders(references, group, frames))
        mesh = refined(reference, [FittedFrame(frame.vertices, ~(frame.held | frame.hidden)) for frame in fitted.values()])
        context.cache.save_result(entry, key, mesh)
    return (key, mesh) if len(mesh.mesh.vertices) > len(reference.mesh.vertices) else (group.key, reference)


def _holders(references: References, group: FrameGroup, frames: tuple[int, ...]) -> Mapping[int, tuple[int, ...]]:
    """Of groups that share a mesh, by index, which of some frames each has in reference positions; each frame once."""
    holders: dict[int, tuple[int, ...]] = {}
    for frame in frames:
        index = references.holder(group, frame)
        holders[index] = (*holders.get(index, ()), frame)
    return holders
