"""The reference stage: groups of frames, their aligned surfaces, and one mesh for each group."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from scipy import sparse

from ..core.geometry import is_watertight, vertex_components
from ..core.reference_mesh import POINTS_PER_TRIANGLE
from ..core.types import TriangleMesh
from ..io.files import output_folder
from ..io.meshes import write_ply
from ..io.report import GroupReport
from .cache import digest
from .context import Context
from .stages import GroupCenters, align_frame, build_reference, place_centers
from .tracked import Tracked, write_centers

REFERENCE_SCHEMA = 1
ALIGNED_SHARE = 0.7  # of the stage's time, roughly
POOR_OVERLAP = 0.9  # IoU with the anchor frame below which a frame is named in the warnings


@dataclass(frozen=True)
class Group:
    """frames : indices into the sequence.  targets : index -> (C, 3) the frame's own reference centers."""

    index: int
    frames: tuple[int, ...]
    centers: GroupCenters
    targets: dict[int, np.ndarray]
    mesh: TriangleMesh
    key: str

    @property
    def anchor(self) -> int:
        """Index into the sequence of the anchor frame."""
        return self.frames[self.centers.anchor]


def refer(context: Context, tracked: Tracked) -> list[Group]:
    """Makes the reference mesh of each group and writes it."""
    spans = context.group_spans
    keys = [digest(REFERENCE_SCHEMA, tracked.part_of(span[0]).key, span, asdict(context.settings.reference)) for span in spans]
    centers = [_placed(context, tracked, *item) for item in enumerate(zip(spans, keys, strict=True))]
    aligned = _aligned(context, tracked, spans, keys, centers)
    meshes = _built(context, spans, keys, centers, aligned)
    groups = []
    for index, span in enumerate(spans):
        targets = {frame: aligned[frame]["targets"] for frame in span}
        mesh = TriangleMesh(meshes[index]["vertices"], meshes[index]["triangles"])
        groups.append(Group(index, span, centers[index], targets, mesh, keys[index]))
        _write(context, groups[-1], aligned, int(meshes[index]["self_intersections"]))
    context.remove_stale("reference/group_*.ply", keep=[group.reference for group in context.report.groups])
    _write_centers(context, tracked, groups)
    return groups


def _placed(context: Context, tracked: Tracked, index: int, span_and_key: tuple) -> GroupCenters:
    span, key = span_and_key
    part = tracked.part_of(span[0])

    def alive(_: float) -> None:
        context.notify("reference", context.numbers[span[0]], 0.0)

    def make() -> dict[str, np.ndarray]:
        placed = place_centers(tracked.positions[list(span)], part.affinity, part.spacing, alive)
        pairs = placed.affinity.tocoo()
        figures = {"anchor": np.int64(placed.anchor), "stress": np.float64(placed.stress)}
        return {"positions": placed.positions, "row": pairs.row, "column": pairs.col, "value": pairs.data, **figures}

    made = context.cache.load_or_make(f"reference/centers_{index:03d}", key, make)
    affinity = sparse.csr_matrix((made["value"], (made["row"], made["column"])), (len(made["positions"]),) * 2)
    return GroupCenters(made["positions"], affinity, part.spacing, int(made["anchor"]), float(made["stress"]))


def _aligned(context: Context, tracked: Tracked, spans, keys, centers) -> dict[int, dict[str, np.ndarray]]:
    """Index of frame -> its aligned points, for all frames of all groups."""
    jobs = [(frame, span, key, group) for span, key, group in zip(spans, keys, centers, strict=True) for frame in span]
    done = {frame: context.cache.load(_aligned_entry(context, frame), key) for frame, _, key, _ in jobs}
    waiting = [job for job in jobs if done[job[0]] is None]
    tasks = (_alignment_task(context, tracked, frame, span, group) for frame, span, _, group in waiting)
    for count, (index, result) in enumerate(context.workers.map(align_frame, tasks, lambda: context.notify("reference", None, 0.0))):
        frame, _, key, _ = waiting[index]
        done[frame] = result
        context.cache.save(_aligned_entry(context, frame), key, result)
        context.notify("reference", context.numbers[frame], ALIGNED_SHARE * (len(jobs) - len(waiting) + count + 1) / len(jobs))
    return done


def _alignment_task(context: Context, tracked: Tracked, frame: int, span: tuple[int, ...], group: GroupCenters) -> tuple:
    anchor = span[group.anchor]
    meshes = context.frames.body(frame), context.frames.body(anchor)
    count = int(POINTS_PER_TRIANGLE * _budget(context, span) / len(span))
    return meshes[0], tracked.positions[frame], meshes[1], tracked.positions[anchor], group, context.settings.reference, count


def _built(context: Context, spans, keys, centers, aligned) -> list[dict[str, np.ndarray]]:
    """The mesh of each group."""
    done = [context.cache.load(f"reference/mesh_{index:03d}", key) for index, key in enumerate(keys)]
    waiting = [index for index, found in enumerate(done) if found is None]
    tasks = (_building_task(context, spans[index], centers[index], aligned) for index in waiting)
    for count, (task, result) in enumerate(
        context.workers.map(build_reference, tasks, lambda: context.notify("reference", None, ALIGNED_SHARE))
    ):
        index = waiting[task]
        done[index] = result
        context.cache.save(f"reference/mesh_{index:03d}", keys[index], result)
        context.notify("reference", None, ALIGNED_SHARE + (1 - ALIGNED_SHARE) * (len(keys) - len(waiting) + count + 1) / len(keys))
    return done


def _building_task(context: Context, span: tuple[int, ...], group: GroupCenters, aligned) -> tuple:
    points, normals = (np.concatenate([aligned[frame][name] for frame in span]) for name in ("points", "normals"))
    anchor = context.frames.body(span[group.anchor])
    return points, normals, anchor, group.spacing, _budget(context, span), context.settings.reference.poisson_depth


def _aligned_entry(context: Context, frame: int) -> str:
    return f"reference/aligned_{context.numbers[frame]:04d}"


def _budget(context: Context, span: tuple[int, ...]) -> int:
    """Triangles of the reference mesh: as asked for, or the median of the group's frames."""
    return context.settings.reference.triangles or int(np.median([len(context.frames.mesh(frame).triangles) for frame in span]))


def _write(context: Context, group: Group, aligned, self_intersections: int) -> None:
    numbers = tuple(context.numbers[frame] for frame in group.frames)
    before, after = ([float(aligned[frame][name]) for frame in group.frames] for name in ("before", "after"))
    for number, overlap in zip(numbers, after, strict=True):
        if overlap < POOR_OVERLAP:
            context.warn(
                f"frame {number}: overlaps its group's anchor frame by only {overlap:.2f} (IoU); a smaller --group-size may serve it better"
            )
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
        )
    )


def _write_centers(context: Context, tracked: Tracked, groups: list[Group]) -> None:
    arrays = {}
    for group in groups:
        arrays[f"group_{group.index:03d}_reference_centers"] = group.centers.positions
        arrays[f"group_{group.index:03d}_center_indices"] = np.arange(len(group.centers.positions))
    write_centers(context, tracked.positions, arrays)
