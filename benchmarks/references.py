"""Reference meshes extracted in several ways, side by side: python -m benchmarks.references INPUT [--frames 6-10]

The frames given are tracked once and are one group, except where the way is a grouping. Each way makes a reference mesh, which
is carried to every frame by the centers alone (`carried`) and then fitted (`fitted`), by the same code for all. Distances are
in % of the diagonal.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from refmesh_addon.core.geometry.mesh import vertex_components
from refmesh_addon.core.geometry.self_intersection import crossing_triangles
from refmesh_addon.core.reference.grouping import content_groups
from refmesh_addon.core.settings import DeformationSettings, ReferenceSettings
from refmesh_addon.pipeline.session.parallel import Workers

from .common import add_tracking_options, tracking_settings
from .grouped import Reference, Take, best_frame, extracted, first_frame, frame_as_reference, judged, processes, tracked_take

OURS = ReferenceSettings()
EXTRACTED = {
    "ours": OURS,
    "ours, near pairs count more": replace(OURS, stress="near"),
    "ours, without alignment": replace(OURS, alignment_steps=0, least_overlap=0.0),
    "ours, all frames count": replace(OURS, least_overlap=0.0),
    "spline (the paper's mapping)": replace(OURS, mapping="rbf"),
    "spline, without alignment": replace(OURS, mapping="rbf", alignment_steps=0, least_overlap=0.0),
}
GROUPINGS = {"ours, groups of 3": 3, "ours, groups of 5": 5, "ours, groups by content": 0}  # frames of a group; 0 cuts by content
CHOSEN = {"first frame": first_frame, "best frame (Collet et al. 2015)": best_frame}
WAYS = [*EXTRACTED, *GROUPINGS, *CHOSEN]


@dataclass(frozen=True)
class Group:
    """Frames and the reference mesh that serves them."""

    take: Take
    reference: Reference


def main() -> None:
    """Prints a row for each way, and all of them as one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", help="folder, file or pattern")
    parser.add_argument("--frames", default="", help="numbers such as 6-10,14; empty takes all")
    parser.add_argument("--ways", nargs="+", choices=WAYS, metavar="WAY", help=f"of {', '.join(WAYS)}")
    add_tracking_options(parser, 256)
    arguments = parser.parse_args()
    take = tracked_take(arguments.input, arguments.frames, tracking_settings(arguments))
    rows = {}
    with processes() as workers:
        for name, make in ways(take, workers).items():
            if arguments.ways and name not in arguments.ways:
                continue
            rows[name] = figures(make(), workers)
            print(f"{name:32}", *(f"{key} {value}" for key, value in rows[name].items()), sep="  ", flush=True)
    print(json.dumps({"benchmark": "references", "input": Path(arguments.input).name, "frames": take.numbers, "rows": rows}))


def ways(take: Take, workers: Workers) -> dict[str, Callable[[], list[Group]]]:
    """Name -> what makes the reference meshes."""
    table = {name: lambda settings=settings: [Group(take, extracted(take, settings, workers))] for name, settings in EXTRACTED.items()}
    table |= {name: lambda size=size: grouped(take, size, workers) for name, size in GROUPINGS.items()}
    return table | {name: lambda choose=choose: [Group(take, frame_as_reference(take, choose(take)))] for name, choose in CHOSEN.items()}


def grouped(take: Take, size: int, workers: Workers) -> list[Group]:
    """A reference mesh for every so many frames, or for each group that the content asks for where `size` is 0."""
    count = len(take.meshes)
    if size:
        spans = [tuple(range(start, min(start + size, count))) for start in range(0, count, size)]
    else:
        spans = content_groups(take.positions, take.affinity, take.spacing, OURS.longest_group)
    parts = [take.part(list(span)) for span in spans]
    return [Group(part, extracted(part, OURS, workers)) for part in parts]


def figures(groups: list[Group], workers: Workers) -> dict[str, float | int | None]:
    """Of reference meshes extracted in one way; distances are from the source, `_back` those to it, including its holes and contacts."""
    results = [judged(group.take, group.reference, DeformationSettings(), workers) for group in groups]
    frames = [len(group.take.meshes) for group in groups]
    before, after = ([iou for group in groups for iou in getattr(group.reference, name)] for name in ("before", "after"))
    distances = {}
    for kind in ("carried", "fitted"):
        for suffix, side in (("", "source_to_deformed"), ("_back", "deformed_to_source")):
            for name in ("mean", "p99", "max"):
                values = [one[kind][f"{side}_{name}"] for one in results]
                distances[f"{kind}{suffix}_{name}"] = max(values) if name == "max" else float(np.average(values, weights=frames))
    return {
        "groups": len(groups),
        "iou_before": round(min(before), 3) if before else None,
        "iou_after": round(min(after), 3) if after else None,
        "components": max(vertex_components(group.reference.mesh)[0] for group in groups),
        "crossing": sum(int(crossing_triangles(group.reference.mesh).sum()) for group in groups),
        **{name: round(value, 4) for name, value in distances.items()},
    }


if __name__ == "__main__":
    main()
