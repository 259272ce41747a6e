"""Reference meshes made in several ways, side by side: python -m benchmarks.references INPUT [--frames 6-10]

All frames given are one group, tracked once. Each way makes a reference mesh, which is carried to every frame by the centers
alone (`carried`) and then fitted (`fitted`), by the same code for all. Distances are in % of the diagonal.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from refmesh_addon.core.geometry import vertex_components
from refmesh_addon.core.self_intersection import crossing_triangles
from refmesh_addon.core.settings import DeformationSettings, ReferenceSettings
from refmesh_addon.pipeline.parallel import Workers

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
CHOSEN = {"first frame": first_frame, "best frame (Collet et al. 2015)": best_frame}


def main() -> None:
    """Prints a row for each way, and all of them as one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", help="folder, file or pattern")
    parser.add_argument("--frames", default="", help="numbers such as 6-10,14; empty takes all")
    parser.add_argument("--ways", nargs="+", choices=[*EXTRACTED, *CHOSEN], metavar="WAY", help=f"of {', '.join([*EXTRACTED, *CHOSEN])}")
    add_tracking_options(parser, 256)
    arguments = parser.parse_args()
    take = tracked_take(arguments.input, arguments.frames, tracking_settings(arguments))
    rows = {}
    with processes() as workers:
        for name, make in ways(take, workers).items():
            if arguments.ways and name not in arguments.ways:
                continue
            rows[name] = figures(take, make(), workers)
            print(f"{name:32}", *(f"{key} {value}" for key, value in rows[name].items()), sep="  ", flush=True)
    print(json.dumps({"benchmark": "references", "input": Path(arguments.input).name, "frames": take.numbers, "rows": rows}))


def ways(take: Take, workers: Workers) -> dict[str, Callable[[], Reference]]:
    """Name -> what makes the reference mesh."""
    made = {name: lambda settings=settings: extracted(take, settings, workers) for name, settings in EXTRACTED.items()}
    return made | {name: lambda choose=choose: frame_as_reference(take, choose(take)) for name, choose in CHOSEN.items()}


def figures(take: Take, reference: Reference, workers: Workers) -> dict[str, float | int | None]:
    """Of one reference mesh; distances are from the source, whose holes and contacts then do not count, `_back` the other way."""
    found = judged(take, reference, DeformationSettings(), workers)
    distances = {
        f"{kind}{suffix}_{name}": found[kind][f"{side}_{name}"]
        for kind in ("carried", "fitted")
        for suffix, side in (("", "source_to_deformed"), ("_back", "deformed_to_source"))
        for name in ("mean", "p99", "max")
    }
    return {
        "iou_before": round(min(reference.before), 3) if reference.before else None,
        "iou_after": round(min(reference.after), 3) if reference.after else None,
        "components": vertex_components(reference.mesh)[0],
        "crossing": int(crossing_triangles(reference.mesh).sum()),
        **{name: round(value, 4) for name, value in distances.items()},
    }


if __name__ == "__main__":
    main()
