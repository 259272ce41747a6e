"""The reference meshes in the output folder: a PLY each, entries in the report, warnings, and the reference centers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.evaluation.rotational_symmetry import symmetric_bodies
from ...core.geometry.mesh import is_watertight, vertex_components
from ...core.reference.budget import ALIGNED_VERTICES, DENSE_TRIANGLES, MAX_TRIANGLES, is_capped
from ...core.reference.group import GroupCenters
from ...io.files import output_folder
from ...io.frame_range import format_others
from ...io.ply import write_ply
from ...io.report import GroupReport
from ..session.context import Context
from .groups import FrameGroup
from .marked_bodies import joined_bodies
from .reference import References, counts_for_the_surface
from .tracking_report import write_centers
from .tracking_result import TrackingResult
from .transients import report_transients


def write_references(context: Context, tracking: TrackingResult, references: References, reasons: tuple[str, ...]) -> None:
    """The mesh of each group as PLY and in the report, and centers.npz with the reference centers.

    reasons : why each group begins where it does.
    """
    output_folder(context.output / "reference")
    _warn_of_cap(context)
    for group in references.groups:
        entry = replace(_group_report(context, references, group), reason=reasons[group.index])
        write_ply(context.claim(entry.reference), references.extended[group.index].mesh)
        context.report.groups.append(entry)
        _warn_of_joined(context, tracking, references, group)
    _warn_of_left_out(context)
    context.remove_stale("reference/group_*.ply", keep=[group.reference for group in context.report.groups])
    arrays: dict[str, np.ndarray] = {}
    for group in references.groups:
        arrays |= _center_arrays(tracking, group, references.centers[group.index])
    write_centers(context, tracking, arrays, references.bodies)
    report_transients(context, references.transients)


def _center_arrays(tracking: TrackingResult, group: FrameGroup, centers: GroupCenters) -> dict[str, np.ndarray]:
    """The reference centers of a group, and which centers these are where it does not have all of them."""
    name, members = f"group_{group.index:03d}", tracking.members(group.source)
    arrays = {f"{name}_reference_centers": centers.positions}
    if len(members) < tracking.positions.shape[1]:
        arrays[f"{name}_center_indices"] = members
    return arrays


def _group_report(context: Context, references: References, group: FrameGroup) -> GroupReport:
    centers, reference = references.centers[group.index], references.meshes[group.index]
    before, after, left_out = [], [], []
    for frame in group.frames:
        aligned = references.aligned[group.index, frame]
        before.append(aligned.iou_before)
        after.append(aligned.iou_after)
        if not counts_for_the_surface(context, aligned):
            left_out.append(context.numbers[frame])
    return GroupReport(
        index=group.index,
        frames=tuple(context.numbers[frame] for frame in group.frames),
        anchor=context.numbers[group.source[centers.anchor]],
        reference=f"reference/group_{group.index:03d}.ply",
        triangles=len(references.extended[group.index].mesh.triangles),
        components=vertex_components(reference.mesh)[0],
        watertight=is_watertight(reference.mesh),
        self_intersections=reference.self_intersections,
        symmetric_bodies=tuple(map(tuple, symmetric_bodies(reference.mesh).tolist())),
        stress=centers.stress,
        iou_before=min(before),
        iou_after=min(after),
        frame_iou_before=tuple(before),
        frame_iou_after=tuple(after),
        left_out=tuple(left_out),
    )


def _warn_of_cap(context: Context) -> None:
    counts = context.frames.counts
    if is_capped(context.settings.reference.triangles, counts):
        usual = f"the frames have about {int(np.median(counts)):,} triangles"
        context.warn(f"{usual}, the reference meshes at most {MAX_TRIANGLES:,} to spare memory; --triangles sets another number")
    if max(counts) > DENSE_TRIANGLES:
        copies = f"copies of about {2 * ALIGNED_VERTICES:,} triangles"
        context.warn(f"dense frames are aligned by {copies}, and only the last round of the fit looks at all of them")


def _warn_of_left_out(context: Context) -> None:
    """One warning for all frames that do not contribute to the surface of their meshes, at the one that overlaps least."""
    overlaps = {
        number: entry.frame_iou_after[entry.frames.index(number)] for entry in context.report.groups for number in entry.left_out
    }
    if overlaps:
        worst = min(overlaps, key=lambda number: overlaps[number])
        others = format_others(overlaps, context.numbers, f"below {context.settings.reference.least_overlap:g}")
        overlap = f"overlaps the anchor frame of its group by only {overlaps[worst]:.2f} (IoU){others}"
        context.warn(f"frame {worst}: {overlap} and does not count for the reference mesh; a smaller --group-size may serve it better")


def _warn_of_joined(context: Context, tracking: TrackingResult, references: References, group: FrameGroup) -> None:
    if references.bodies is None:
        return
    bodies = references.bodies[tracking.members(group.source)]
    joined = joined_bodies(references.meshes[group.index].mesh, references.centers[group.index].positions, bodies)
    if joined:
        names = " and ".join(str(body + 1) for body in joined)
        where = f"in the mesh of the group that begins with frame {context.numbers[group.frames[0]]}"
        context.warn(f"bodies {names} are still connected {where}: mark more of each (--apart), or take more centers")
