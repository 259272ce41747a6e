"""Which frames should make the one mesh of a take: python -m benchmarks.segment_mesh INPUT [--frames 5-14] [--set name=value]

The take is one run: tracked once, its frames aligned once in its own reference positions. Then three meshes are reconstructed with as
many triangles, deformed to every frame and measured: from all frames; from those of the first group; and from those of the group that
shows the most surface apart (Collet et al. 2015: more components, then lower genus, then larger area). The anchor frame always counts.
Captures that are closed but for holes only.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from refmesh_addon.core.geometry.half_edges import HalfEdges
from refmesh_addon.core.geometry.mesh import triangle_areas, vertex_components
from refmesh_addon.core.geometry.stretch import RestShape
from refmesh_addon.core.reference.budget import triangle_budget
from refmesh_addon.core.reference.group import ReferenceMesh
from refmesh_addon.core.settings import Settings, flat_fields
from refmesh_addon.core.types import TriangleMesh
from refmesh_addon.pipeline.session.cache import digest
from refmesh_addon.pipeline.session.cached_map import cached_map
from refmesh_addon.pipeline.session.context import Context
from refmesh_addon.pipeline.session.job import JobSpec
from refmesh_addon.pipeline.session.job_input import job_sequence
from refmesh_addon.pipeline.session.parallel import Workers
from refmesh_addon.pipeline.stages.deformation import deform
from refmesh_addon.pipeline.stages.evaluation import measure_frames
from refmesh_addon.pipeline.stages.groups import chosen_groups
from refmesh_addon.pipeline.stages.reconstruction import build_with
from refmesh_addon.pipeline.stages.reference import BUILDING, AlignedGroups, References, align_groups, building_units, group_frames
from refmesh_addon.pipeline.stages.tracking import track_sequence
from refmesh_addon.pipeline.stages.tracking_result import TrackingResult

from .common import assignment

SAMPLED = 3  # times as many points of each frame as a job takes, so that those of a single group suffice


def apartness(mesh: TriangleMesh) -> tuple[int, int, float]:
    """Components, genus below zero, and area of a frame: the greatest shows the most surface apart."""
    components = vertex_components(mesh)[0]
    handles = components - (len(mesh.vertices) - len(HalfEdges.of(mesh).edges) + len(mesh.triangles)) // 2
    return components, -handles, float(triangle_areas(mesh).sum())


def choices(context: Context, groups: list[tuple[int, ...]]) -> dict[str, tuple[int, ...]]:
    """Name -> indices of the frames whose points count."""
    apart = max(groups, key=lambda group: max(apartness(context.frames.body(frame)) for frame in group))
    return {"all": tuple(range(len(context.frames))), "first": groups[0], "apart": apart}


def made_from(context: Context, tracking: TrackingResult, aligned: AlignedGroups, name: str, frames: Iterable[int]) -> References:
    """The reference mesh of the only run, of the points of some frames."""
    (group,) = aligned.groups
    counted = {*frames, group.frames[aligned.centers[0].anchor]}
    overlaps = {frame: aligned.aligned[0, frame].iou_after if frame in counted else -1.0 for frame in group.frames}
    some = {(0, frame): replace(aligned.aligned[0, frame], iou_after=overlap) for frame, overlap in overlaps.items()}
    own = replace(group, key=digest(group.key, name), folder=f"{name}/")
    chosen = AlignedGroups((own,), aligned.bodies, aligned.centers, some)
    meshes = cached_map(context, build_with, building_units(context, tracking, chosen), ReferenceMesh, BUILDING)
    return References(**vars(chosen), meshes=meshes, transients={})


def figures(context: Context, tracking: TrackingResult, references: References) -> dict[str, float]:
    """Of the frames, in % of the diagonal, of triangles and of the surface; `largest_stretch` is a factor."""
    deformed, (group,) = deform(context, tracking, references), references.groups
    measured, rest = measure_frames(context, deformed), RestShape(references.meshes[0].mesh)
    there = [measured[frame].distances.source_to_deformed for frame in group.frames]
    back = [measured[frame].distances.visible_to_source for frame in group.frames]
    rows = [deformed.row(group, row) for row in range(len(group.frames))]
    values = {
        "mean": 100 * np.mean([one.mean for one in there]),
        "worst_mean": 100 * max(one.mean for one in there),
        "worst_p99": 100 * max(one.p99 for one in there),
        "worst_visible": 100 * max(one.max for one in back),
        "flipped": 100 * max(row.flipped for row in rows),
        "overstretched": 100 * max(rest.overstretched(row.vertices) for row in rows),
        "largest_stretch": max(rest.stretches(row.vertices).max() for row in rows),
        "components": vertex_components(references.meshes[0].mesh)[0],
    }
    return {name: round(float(value), 4) for name, value in values.items()}


def compared(spec: JobSpec, workers: Workers) -> dict[str, dict[str, float]]:
    """Figures of each choice."""
    context = Context.open(spec, job_sequence(spec), lambda *_: None, lambda line: print(line, file=sys.stderr), workers)
    tracking = track_sequence(context)
    needed = [frame.needed_triangles for frame in context.frames.statistics]
    triangles = triangle_budget(spec.settings.reference.triangles, list(context.frames.counts), needed)
    budgets = [Settings.from_flat({**spec.settings.to_flat(), "triangles": count}) for count in (SAMPLED * triangles, triangles)]
    sampled, reduced = (replace(context, settings=settings) for settings in budgets)
    aligned = align_groups(sampled, tracking, group_frames(sampled, tracking, None, [tuple(range(len(context.frames)))], segment=True))
    rows = {}
    for name, frames in choices(context, chosen_groups(context, tracking)).items():
        rows[name] = figures(reduced, tracking, made_from(reduced, tracking, aligned, name, frames))
        numbers = f"{context.numbers[frames[0]]}-{context.numbers[frames[-1]]}"
        print(f"{name:6} frames {numbers:9}", *(f"{key} {value:g}" for key, value in rows[name].items()), sep="  ", flush=True)
    return rows


def main() -> None:
    """Prints a row for each choice, and all of them as one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", help="folder, file or pattern")
    parser.add_argument("--frames", default="", help="numbers such as 6-10,14; empty takes all")
    to_setting = assignment(flat_fields())
    parser.add_argument("--set", action="append", default=[], type=to_setting, metavar="NAME=VALUE", help="any setting of the job")
    arguments = parser.parse_args()
    settings = Settings.from_flat(dict(arguments.set))
    with TemporaryDirectory() as output, Workers() as workers:
        rows = compared(JobSpec(arguments.input, output, arguments.frames, settings), workers)
    print(json.dumps({"benchmark": "segment_mesh", "input": Path(arguments.input).name, "frames": arguments.frames, "rows": rows}))


if __name__ == "__main__":
    main()
