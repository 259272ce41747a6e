"""The command line that benchmarks of whole jobs on generated takes share."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path

from refmesh_addon.core.settings import Settings, flat_fields

from .common import assignment
from .frames import CACHE
from .trajectories import CASES

# measured(case, (frames taken, frames of the whole sequence), settings, folder of generated frames) -> values by name
Measured = Callable[[str, tuple[int, int], Settings, Path], dict[str, float]]


def run_takes(benchmark: str, description: str | None, default: Sequence[str], measured: Measured) -> None:
    """Runs every case that the command line names, prints a table and then one line of JSON. default : cases where it names none."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    forwards = [name for name, (_, backwards) in CASES.items() if not backwards]
    parser.add_argument("--cases", nargs="+", default=list(default), choices=forwards, metavar="CASE", help=f"of {', '.join(forwards)}")
    parser.add_argument("--frames", type=int, default=10, help="how many are taken, from the first on (default: %(default)s)")
    parser.add_argument("--of", type=int, default=30, help="frames from time 0 to 1 (default: %(default)s)")
    to_setting = assignment(flat_fields())
    parser.add_argument("--set", action="append", default=[], type=to_setting, metavar="NAME=VALUE", help="any setting of the job")
    parser.add_argument("--cache", type=Path, default=CACHE, help="folder for generated frames")
    arguments = parser.parse_args()
    settings, results = Settings.from_flat({"resolution": 128, **dict(arguments.set)}), {}
    for name in arguments.cases:
        row = results[name] = measured(name, (arguments.frames, arguments.of), settings, arguments.cache)
        print(f"{name:8}", *(f"{key} {value:g}" for key, value in row.items()), sep="  ", flush=True)
    counts = {"frames": arguments.frames, "of": arguments.of}
    print(json.dumps({"benchmark": benchmark, **counts, "settings": settings.to_flat(), "cases": results}))
