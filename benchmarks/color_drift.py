"""Drift removed by color: whole jobs with and without it, on textured takes whose true motion is known.

    python -m benchmarks.color_drift [--cases grasp walk] [--frames 8] [--of 24] [--size 1024] [--set name=value]

Drift is that of `benchmarks.drift`, over all frames but the anchor, after smoothing. The second job takes up the fits of the first.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from refmesh_addon.core.settings import Settings, flat_fields
from refmesh_addon.io.report import read_report
from refmesh_addon.pipeline.run import run
from refmesh_addon.pipeline.session.job import JobSpec
from sample_scenes.generators.textured import TEXTURED, write_frame

from .color import mean_of
from .common import assignment
from .drift import takes
from .trajectories import Case

DECIMALS = 5  # of the vertices: some sequences are two units tall


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", default=list(TEXTURED), choices=TEXTURED, metavar="CASE", help=f"of {', '.join(TEXTURED)}")
    parser.add_argument("--frames", type=int, default=8, help="how many are taken, from the first on (default: %(default)s)")
    parser.add_argument("--of", type=int, default=24, help="frames from time 0 to 1 (default: %(default)s)")
    parser.add_argument("--size", type=int, default=1024, help="texels along a side of the source's atlases")
    setting = assignment(flat_fields())
    parser.add_argument("--set", type=setting, action="append", default=[], metavar="NAME=VALUE", help="any setting of the jobs")
    arguments = parser.parse_args()
    settings = Settings.from_flat({"resolution": 128, "texture": "off", **dict(arguments.set)})
    cases = {}
    for name in arguments.cases:
        with tempfile.TemporaryDirectory() as scratch:
            case = generated(name, Path(scratch) / "frames", arguments)
            cases[name] = compared(case, Path(scratch), settings)
        print(f"{name:8}", *(f"{key} {value:g}" for key, value in cases[name].items()), sep="  ", flush=True)
    print(json.dumps({"benchmark": "color_drift", "frames": arguments.frames, "of": arguments.of, "cases": cases}))


def generated(name: str, folder: Path, arguments: argparse.Namespace) -> Case:
    """The case, and its frames on disk."""
    textured, times = TEXTURED[name](), np.linspace(0.0, 1.0, arguments.of)[: arguments.frames]
    folder.mkdir()
    for index, moment in enumerate(times):
        write_frame(folder, f"frame_{index + 1:04d}", textured.frame(moment, index, arguments.size), decimals=DECIMALS)
    return Case(textured.sequence, times, [])


def compared(case: Case, folder: Path, settings: Settings) -> dict[str, float]:
    """Figures of both jobs, and the worst ratio that a frame has of one to the other."""
    before, after = (_job(case, folder, settings, switch) for switch in ("off", "on"))
    result = {}
    for name in ("median", "p95", "distance", "flipped"):
        result |= {f"{name}_before": float(np.mean(before[name])), f"{name}_after": float(np.mean(after[name]))}
    for name in ("median", "distance"):
        result[f"worst_{name}_ratio"] = max(new / old for old, new in zip(before[name], after[name], strict=True))
    return mean_of([result | {"seconds_per_frame": after["seconds"] / len(after["distance"])}])


def _job(case: Case, folder: Path, settings: Settings, switch: str) -> dict:
    """Per frame: median and 95th percentile of the drift, distance of what the capture shows and flips; seconds of the job."""
    settings = replace(settings, color=replace(settings.color, color_drift=switch))
    start, warn = time.perf_counter(), lambda line: print(line, file=sys.stderr)
    run(JobSpec(str(folder / "frames"), str(folder / "out"), settings=settings), lambda *_: None, warn)
    seconds, frames = time.perf_counter() - start, read_report(folder / "out")["frames"]
    drifts = np.concatenate([take.drift for take in takes(case, folder / "out")])
    figures = {"median": np.median(drifts, axis=1), "p95": np.quantile(drifts, 0.95, axis=1), "seconds": seconds}
    return figures | {
        "distance": np.array([frame["visible_to_source"]["mean"] for frame in frames]),
        "flipped": np.array([frame["flipped"] for frame in frames]),
    }


if __name__ == "__main__":
    main()
