"""The reference stage: groups of frames, their aligned surfaces, and one mesh for each group."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from ...core.arrays import from_arrays, to_arrays
from ...core.geometry.mesh import is_watertight, vertex_components
from ...core.reference.budget import points_per_frame, triangle_budget
from ...core.reference.group import AlignedFrame, GroupCenters, ReferenceMesh, align_frame, anchor_frame, build_reference, place_centers
from ...core.types import TriangleMesh
from ...io.files import output_folder
from ...io.ply import write_ply
from ...io.report import GroupReport
from ..session.cache import digest
from ..session.context import Context
from .groups import group_spans
from .marked_bodies import bodies_apart, joined_bodies
from .tracking_result import Tracked, write_centers

REFERENCE_SCHEMA = 8
ALIGNED_SHARE = 0.7  # of the stage's time, roughly
# Settings that a group's mesh depends on through its frames, and through the bodies that the centers belong to, only.
INDIRECT = ("group_size", "longest_group", "group_starts", "apart")


Aligned = dict[tuple[int, int], AlignedFrame]  # by index of group and index of frame


@dataclass(frozen=True)
class Group:
    """frames : indices into the sequence.  handover : the next group's first frame, which this group's mesh is carried to as well.

    targets : index -> (C, 3) the frame's own reference centers, of all these frames.
    """

    index: int
    frames: tuple[int, ...]
    handover: int | None
    centers: GroupCenters
    targets: dict[int, np.ndarray]
    mesh: TriangleMesh
    key: str

    @property
    def anchor(self) -> int:
        """Index into the sequence of the anchor frame."""
        return self.frames[self.centers.anchor]


@dataclass(frozen=True)
class _Span:
    """Frames of a group, the first of the next group if there is one, and the key of all that is made of them."""

    index: int
    frames: tuple[int, ...]
    handover: int | None
    key: str

    @property
    def reached(self) -> tuple[int, ...]:
        return self.frames if self.handover is None else (*self.frames, self.handover)


def refer(context: Context, tracked: Tracked) -> list[Group]:
    """Makes the reference mesh of each group and writes it."""
    bodies = bodies_apart(context, tracked)
    spans = _spans(context, tracked, bodies)
    centers = [_placed(context, tracked, span, bodies) for span in spans]
    aligned = _aligned(context, tracked, spans, centers)
    meshes = _built(context, spans, centers, aligned)
    groups = []
    for span, placed, made in zip(spans, centers, meshes, strict=True):
        targets = {frame: aligned[span.index, frame].targets for frame in span.reached}
        groups.append(Group(span.index, span.frames, span.handover, placed, targets, made.mesh, span.key))
        _write(context, groups[-1], aligned, made.self_intersections)
        _warn_of_joined(context, groups[-1], bodies)
    context.remove_stale("reference/group_*.ply", keep=[group.reference for group in context.report.groups])
    _write_centers(context, tracked, groups, bodies)
    return groups


def _spans(context: Context, tracked: Tracked, bodies: np.ndarray | None) -> list[_Span]:
    settings = {name: value for name, value in asdict(context.settings.reference).items() if name not in INDIRECT}
    apart = [] if bodies is None else [bodies.tolist()]
    found = group_spans(context, tracked)
    handovers = [following[0] for following in found[1:]] + [None]
    keys = [digest(REFERENCE_SCHEMA, tracked.part_of(frames[0]).key, frames, settings, *apart) for frames in found]
    return [_Span(index, *item) for index, item in enumerate(zip(found, handovers, keys, strict=True))]


def _placed(context: Context, tracked: Tracked, span: _Span, bodies: np.ndarray | None) -> GroupCenters:
    part = tracked.part_of(span.frames[0])

    def alive(_: float) -> None:
        context.notify("reference", context.numbers[span.frames[0]], 0.0)

    def make() -> dict[str, np.ndarray]:
        settings = context.settings.reference
        return to_arrays(place_centers(tracked.seen(span.frames), part.affinity, part.spacing, settings, alive, bodies))

    return from_arrays(GroupCenters, context.cache.load_or_make(f"reference/centers_{span.index:03d}", span.key, make))


def _aligned(context: Context, tracked: Tracked, spans: list[_Span], centers: list[GroupCenters]) -> Aligned:
    """(index of group, index of frame) -> aligned points, for all frames of all groups and the hand-overs."""
    jobs = [(span, frame) for span in spans for frame in span.reached]
    done = {(span.index, frame): _loaded(context, AlignedFrame, _aligned_entry(context, span, frame), span.key) for span, frame in jobs}
    waiting = [(span, frame) for span, frame in jobs if done[span.index, frame] is None]
    tasks = (_alignment_task(context, tracked, span, frame, centers[span.index]) for span, frame in waiting)
    for count, (index, result) in enumerate(context.workers.map(_align_to_anchor, tasks, lambda: context.notify("reference", None, 0.0))):
        span, frame = waiting[index]
        done[span.index, frame] = result
        context.cache.save(_aligned_entry(context, span, frame), span.key, to_arrays(result))
        context.notify("reference", context.numbers[frame], ALIGNED_SHARE * (len(jobs) - len(waiting) + count + 1) / len(jobs))
    return done


def _alignment_task(context: Context, tracked: Tracked, span: _Span, frame: int, group: GroupCenters) -> tuple:
    anchor = span.frames[group.anchor]
    anchor_centers, centers = tracked.seen((anchor, frame))
    count = points_per_frame(_budget(context, span.frames), len(span.frames))
    return context.frames.body(frame), centers, context.frames.body(anchor), anchor_centers, group, context.settings.reference, count


def _align_to_anchor(mesh, centers, anchor_mesh, anchor_centers, group, settings, count: int) -> AlignedFrame:
    anchor = anchor_frame(anchor_mesh, anchor_centers, group, settings)
    return align_frame(mesh, centers, anchor, group, settings, count)


def _built(context: Context, spans: list[_Span], centers: list[GroupCenters], aligned: Aligned) -> list[ReferenceMesh]:
    """The mesh of each group."""
    done = [_loaded(context, ReferenceMesh, f"reference/mesh_{span.index:03d}", span.key) for span in spans]
    waiting = [index for index, found in enumerate(done) if found is None]
    tasks = (_building_task(context, spans[index], centers[index], aligned) for index in waiting)
    for count, (task, result) in enumerate(
        context.workers.map(build_reference, tasks, lambda: context.notify("reference", None, ALIGNED_SHARE))
    ):
        index = waiting[task]
        done[index] = result
        context.cache.save(f"reference/mesh_{index:03d}", spans[index].key, to_arrays(result))
        context.notify("reference", None, ALIGNED_SHARE + (1 - ALIGNED_SHARE) * (len(spans) - len(waiting) + count + 1) / len(spans))
    return done


def _building_task(context: Context, span: _Span, group: GroupCenters, aligned: Aligned) -> tuple:
    kept = [frame for frame in span.frames if not _left_out(context, aligned[span.index, frame])]
    points, normals = (np.concatenate([getattr(aligned[span.index, frame], name) for frame in kept]) for name in ("points", "normals"))
    anchor = context.frames.body(span.frames[group.anchor])
    return points, normals, anchor, group.spacing, _budget(context, span.frames), context.settings.reference.poisson_depth


def _left_out(context: Context, aligned: AlignedFrame) -> bool:
    """Whether a frame lies too far from the anchor frame to count for the surface; the anchor itself never does."""
    return aligned.iou_after < context.settings.reference.least_overlap


def _loaded(context: Context, kind: type, entry: str, key: str):
    arrays = context.cache.load(entry, key)
    return None if arrays is None else from_arrays(kind, arrays)


def _aligned_entry(context: Context, span: _Span, frame: int) -> str:
    return f"reference/handover_{span.index:03d}" if frame == span.handover else f"reference/aligned_{context.numbers[frame]:04d}"


def _budget(context: Context, span: tuple[int, ...]) -> int:
    return triangle_budget(context.settings.reference.triangles, [context.frames.counts[frame] for frame in span])


def _write(context: Context, group: Group, aligned: Aligned, self_intersections: int) -> None:
    numbers = tuple(context.numbers[frame] for frame in group.frames)
    before, after = ([getattr(aligned[group.index, frame], name) for frame in group.frames] for name in ("iou_before", "iou_after"))
    left_out = tuple(context.numbers[frame] for frame in group.frames if _left_out(context, aligned[group.index, frame]))
    for number in left_out:
        overlap = f"overlaps its group's anchor frame by only {after[numbers.index(number)]:.2f} (IoU)"
        context.warn(f"frame {number}: {overlap} and is left out of the reference mesh; a smaller --group-size may serve it better")
    path = f"reference/group_{group.index:03d}.ply"
    output_folder(context.output / "reference")
    write_ply(context.output / path, group.mesh)
    context.report.groups.append(
        GroupReport(
            index=group.index,
            frames=numbers,
            anchor=context.numbers[group.anchor],
            reference=path,
            triangles=len(group.mesh.triangles),
            components=vertex_components(group.mesh)[0],
            watertight=is_watertight(group.mesh),
            self_intersections=self_intersections,
            stress=group.centers.stress,
            iou_before=min(before),
            iou_after=min(after),
            frame_iou_before=tuple(before),
            frame_iou_after=tuple(after),
            left_out=left_out,
        )
    )


def _warn_of_joined(context: Context, group: Group, bodies: np.ndarray | None) -> None:
    joined = [] if bodies is None else joined_bodies(group.mesh, group.centers.positions, bodies)
    if joined:
        names = " and ".join(str(body + 1) for body in joined)
        first = context.numbers[group.frames[0]]
        where = f"in the mesh of the group that begins with frame {first}"
        context.warn(f"bodies {names} still hang together {where}: mark more of each, or take more centers")


def _write_centers(context: Context, tracked: Tracked, groups: list[Group], bodies: np.ndarray | None) -> None:
    arrays = {f"group_{group.index:03d}_reference_centers": group.centers.positions for group in groups}
    write_centers(context, tracked, arrays, bodies)
