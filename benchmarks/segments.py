"""One mesh for a whole take: how many meshes it needs, how near they stay, and how far vertices drift, beside a mesh for each group.

    python -m benchmarks.segments [--cases walk gears] [--frames 121] [--modes groups long] [--one-camera]
        [--set name=value] [--keep FOLDER]

The whole job on long synthetic takes, with few centers and triangles so that it is affordable. Drift is judged in the frames of a run
that are farthest from its anchor frame in time, in mean edge lengths, against the closed-form motion; of what one camera sees, in all.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from contextlib import nullcontext
from pathlib import Path

import numpy as np

from refmesh_addon.core.settings import Settings, flat_fields
from refmesh_addon.io.report import read_report
from refmesh_addon.pipeline.run import run
from refmesh_addon.pipeline.session.job import JobSpec

from .common import assignment
from .drift import Take, takes
from .frames import CACHE, frames_folder, one_camera_folder
from .one_camera import visible_drift
from .trajectories import CASES, Case

# Limbs, bending, twisting, a turn of the whole body, contact, bodies against each other.
LONG_TAKES = ("walk", "bend", "twist", "tumble", "clasp", "gears")
AFFORDABLE = {"centers": 400, "resolution": 128, "alignment_steps": 3, "fit_rounds": 4, "samples": 10_000, "triangles": 8000}


def drift_at_the_ends(runs: list[Take]) -> dict[str, float]:
    """The median and the 95th percentile in the frame of each run that is farthest from its anchor; the worst of the runs."""
    ends = [np.linalg.norm(take.vertices[row] - take.truth[row], axis=1) / take.length for take in runs for row in [_farthest(take)]]
    return {"drift_median": max(np.median(end) for end in ends), "drift_p95": max(np.quantile(end, 0.95) for end in ends)}


def _farthest(take: Take) -> int:
    return 0 if take.anchor > len(take.indices) - 1 - take.anchor else len(take.indices) - 1


def distances(report: dict) -> dict[str, float]:
    """Of the frames, in % of the diagonal and of triangles and surface."""
    there = [frame["source_to_deformed"] for frame in report["frames"]]
    return {
        "meshes": len(report["groups"]),
        "mean": 100 * np.mean([frame["mean"] for frame in there]),
        "worst_mean": 100 * max(frame["mean"] for frame in there),
        "worst_p99": 100 * max(frame["p99"] for frame in there),
        "flipped": 100 * max(frame["flipped"] for frame in report["frames"]),
        "overstretched": 100 * max(frame["overstretched"] for frame in report["frames"]),
    }


def drift_in_view(case: Case, output: Path, report: dict) -> dict[str, float]:
    """The median and the 95th percentile in all frames, and the share of the meshes that is out of view."""
    drift, _ = visible_drift(case, output, report)
    unseen = 100 * np.mean([frame["unseen"] for frame in report["frames"]])
    return {"drift_median": np.median(drift), "drift_p95": np.quantile(drift, 0.95), "unseen": unseen}


def measured(name: str, count: int, settings: Settings, folders: tuple[Path, Path | None], one_camera: bool = False) -> dict[str, float]:
    """Runs one case and judges it.

    folders : for generated frames, and for the results, with which an interrupted run goes on.  one_camera : whether one camera sees it.
    """
    cache, keep = folders
    case, source = Case.named(name, count, cache), (one_camera_folder if one_camera else frames_folder)(CASES[name][0], count, cache)
    with nullcontext(str(keep)) if keep else tempfile.TemporaryDirectory() as output:
        run(JobSpec(str(source), output, settings=settings), lambda *_: None, lambda line: print(line, file=sys.stderr))
        report = read_report(output)
        at = Path(output)
        result = distances(report) | (drift_in_view(case, at, report) if one_camera else drift_at_the_ends(takes(case, at)))
    for group in report["groups"]:
        print(f"  frames {group['frames'][0]} to {group['frames'][-1]}: {group['reason']}", file=sys.stderr)
    return {key: round(float(value), 4) for key, value in result.items()} | {"seconds": round(sum(report["seconds"].values()), 1)}


def main() -> None:
    """Runs every case in every mode, prints a table and then one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    forwards = [name for name, (_, backwards) in CASES.items() if not backwards]
    parser.add_argument("--cases", nargs="+", default=list(LONG_TAKES), choices=forwards, metavar="CASE")
    parser.add_argument("--frames", type=int, default=121, help="from time 0 to 1 (default: %(default)s)")
    parser.add_argument("--modes", nargs="+", default=["groups", "long"], choices=["groups", "long"], help="as --segments takes them")
    parser.add_argument("--one-camera", action="store_true", help="as one virtual depth camera sees them")
    to_setting = assignment(flat_fields())
    parser.add_argument("--set", action="append", default=[], type=to_setting, metavar="NAME=VALUE", help="any setting of the job")
    parser.add_argument("--cache", type=Path, default=CACHE, help="folder for generated frames")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="for the results: an interrupted benchmark goes on from there")
    arguments = parser.parse_args()
    results = {}
    for name in arguments.cases:
        for mode in arguments.modes:
            settings = Settings.from_flat({**AFFORDABLE, "segments": mode, **dict(arguments.set)})
            keep = arguments.keep and arguments.keep / f"{name}-{arguments.frames}-{mode}"
            row = measured(name, arguments.frames, settings, (arguments.cache, keep), arguments.one_camera)
            results[f"{name} {mode}"] = row
            print(f"{name:8} {mode:7}", *(f"{key} {value:g}" for key, value in row.items()), sep="  ", flush=True)
    print(json.dumps({"benchmark": "segments", "frames": arguments.frames, "settings": AFFORDABLE, "results": results}))


if __name__ == "__main__":
    main()
