"""Time of the deformation stage: a job up to the reference meshes once, then that stage alone, repeatedly.

    python -m benchmarks.deformation_speed [INPUT --frames 5-14] [--against CHECKOUT]

Another checkout of this project is timed in turns with this one, so that both see the same noise of the machine; the ratio is
its seconds over ours. Processor seconds are those of a job that finds everything before the stage in its cache, minus those of
one that stops there.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from refmesh_addon.core.settings import Settings, flat_fields
from refmesh_addon.io.report import read_report
from refmesh_addon.pipeline.process.single_thread import SINGLE_THREAD
from refmesh_addon.pipeline.session.job import CACHE_FOLDER, JobSpec

from .common import assignment
from .frames import CACHE, ROOT, frames_folder

SEQUENCE, TRIANGLES = "clasp", 40_000  # the default input, and the triangles of its reference mesh: 20,000 vertices
FRAMES = 10  # of the default input
JOB = """if True:
    import sys
    from refmesh_addon.pipeline.session.job import JobSpec
    from refmesh_addon.pipeline.run import run
    run(JobSpec.from_json(sys.argv[1]), lambda *_: None, lambda line: print(line, file=sys.stderr))
"""


def processor_seconds(checkout: Path, spec: JobSpec) -> float:
    """Runs a job with the code of a checkout and returns what it took of all processors."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, **SINGLE_THREAD, "PYTHONPATH": str(checkout)}
    subprocess.run([sys.executable, "-c", JOB, spec.to_json()], cwd=checkout, env=environment, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def deformed_again(checkout: Path, spec: JobSpec) -> tuple[float, float]:
    """Seconds of the stage, and of all processors, when nothing of it is in the cache."""
    idle = processor_seconds(checkout, replace(spec, until="reference"))
    shutil.rmtree(Path(spec.output) / CACHE_FOLDER / "deformation", ignore_errors=True)
    busy = processor_seconds(checkout, replace(spec, until="deformation"))
    return read_report(spec.output)["seconds"]["deformation"], busy - idle


def compared(checkouts: dict[str, Path], spec: JobSpec, repeat: int, folder: Path) -> dict[str, dict[str, float]]:
    """The least of `repeat` runs of each checkout."""
    specs = {name: replace(spec, output=str(folder / name)) for name in checkouts}
    for name, checkout in checkouts.items():
        processor_seconds(checkout, replace(specs[name], until="reference"))
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in checkouts}
    for _ in range(repeat):
        for name, checkout in checkouts.items():
            times[name].append(deformed_again(checkout, specs[name]))
    return {name: _figures(read_report(specs[name].output), np.min(times[name], axis=0)) for name in checkouts}


def _figures(report: dict, seconds: np.ndarray) -> dict[str, float]:
    frames = len(report["frames"]) + len(report["groups"]) - 1  # with the hand-overs from group to group
    triangles = [group["triangles"] for group in report["groups"]]
    wall, processor = (round(float(value), 2) for value in seconds)
    each = round(wall / frames, 2), round(processor / frames, 2)
    return {"triangles": max(triangles), "deformed": frames, "seconds": wall, "processor_seconds": processor} | dict(
        zip(("seconds_per_frame", "processor_seconds_per_frame"), each)
    )


def main() -> None:
    """Times the stage, prints a table and then one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", nargs="?", help=f"a mesh sequence (default: {FRAMES} frames of {SEQUENCE})")
    parser.add_argument("--frames", default="", help="numbers as in the file names")
    parser.add_argument("--against", type=Path, metavar="CHECKOUT", help="another state of this project to be timed as well")
    parser.add_argument("--cache", type=Path, default=CACHE, help="folder for generated frames")
    parser.add_argument("--repeat", type=int, default=2, help="runs of which the least counts (default: %(default)s)")
    to_setting = assignment(flat_fields())
    parser.add_argument("--set", action="append", default=[], type=to_setting, metavar="NAME=VALUE", help="any setting of the job")
    arguments = parser.parse_args()
    source = arguments.input or frames_folder(SEQUENCE, FRAMES, arguments.cache)
    preset = {"segments": "groups", "group_size": 10, **({} if arguments.input else {"triangles": TRIANGLES})}
    settings = Settings.from_flat({**preset, **dict(arguments.set)})
    checkouts = {"here": ROOT, **({"against": arguments.against.resolve()} if arguments.against else {})}
    with tempfile.TemporaryDirectory() as folder:
        spec = JobSpec(str(Path(source).resolve()), folder, arguments.frames, settings)
        states = compared(checkouts, spec, arguments.repeat, Path(folder))
    for name, row in states.items():
        print(f"{name:8}", *(f"{key} {value:g}" for key, value in row.items()), sep="  ")
    ratio = {"ratio": round(states["against"]["seconds"] / states["here"]["seconds"], 2)} if arguments.against else {}
    print(json.dumps({"benchmark": "deformation_speed", "processors": os.cpu_count(), **ratio, "states": states}))


if __name__ == "__main__":
    main()
