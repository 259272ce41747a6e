"""Our tracker against the published schedule: same frames, same first centers, same process, to the same end energy.

    python -m benchmarks.tracking [INPUT --frames 6-8] [--limit SECONDS]

Both are timed from the mesh to the centers of each frame after the first, the filling of the volume included.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from refmesh_addon.core.settings import TrackingSettings
from refmesh_addon.core.types import TriangleMesh

from . import published_tracking
from .common import add_tracking_options, read_bodies, tracked, tracking_settings
from .frames import CACHE, frames_folder

DEFAULT_SEQUENCE, DEFAULT_COUNT, DEFAULT_FRAMES = "bar", 30, "14-15"  # where the bar bends and twists fastest
PUBLISHED_RESOLUTION = 512
TOLERANCE = 1.01  # end energies up to this ratio count as the same


def ours(meshes: list[TriangleMesh], settings: TrackingSettings) -> tuple[list[np.ndarray], list[float], list[int]]:
    """Centers, seconds and steps of each frame."""
    centers, seconds, steps = [], [], []
    began = time.perf_counter()
    for state, _ in tracked(meshes, settings):
        seconds.append(time.perf_counter() - began)
        centers.append(state.centers)
        steps.append(state.steps)
        began = time.perf_counter()
    return centers, seconds, steps


def compared(meshes: list[TriangleMesh], settings: TrackingSettings, limit: float) -> tuple[list[dict], bool]:
    """One row for each frame after the first, and whether the published schedule came to its end within the limit."""
    centers, seconds, steps = ours(meshes, settings)
    published = published_tracking.track(meshes, settings.resolution, centers[0], limit)
    reached = len(published)
    judge = lambda trajectory: published_tracking.energies(trajectory[:reached], meshes[:reached], settings.resolution)
    our_energies, their_energies = judge(centers), judge([frame.centers for frame in published])
    rows = []
    for index in range(1, reached):
        frame = published[index]
        caught_up = frame.seconds_to(sum(our_energies[index]))
        rows.append(
            {
                "seconds": seconds[index],
                "published": frame.seconds,
                "caught up": frame.seconds if caught_up is None else caught_up,
                "never": caught_up is None,
                "steps": steps[index],
                "published steps": len(frame.trace),
                "lloyd": our_energies[index][0],
                "published lloyd": their_energies[index][0],
                "arap": our_energies[index][1],
                "published arap": their_energies[index][1],
            }
        )
    return rows, published[-1].finished


def figures(rows: list[dict], finished: bool) -> dict[str, object]:
    """The line of JSON: sums over frames, and the ratios that matter."""
    total = {name: sum(row[name] for row in rows) for name in rows[0]}
    energy = (total["lloyd"] + total["arap"]) / (total["published lloyd"] + total["published arap"])
    return {
        "frames": len(rows),
        "seconds": total["seconds"],
        "published_seconds": total["published"],
        "ratio": total["published"] / total["seconds"],
        "published_finished": finished,
        "energy_ratio": energy,
        "same_energy": energy <= TOLERANCE,
        "arap_energy_ratio": total["arap"] / total["published arap"],
        "ratio_to_our_energy": total["caught up"] / total["seconds"],
        "frames_it_never_got_there": total["never"],
        "steps": total["steps"],
        "published_steps": total["published steps"],
    }


def main() -> None:
    """Compares, prints a table and then one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", nargs="?", help=f"as the pipeline takes it (default: frames {DEFAULT_FRAMES} of {DEFAULT_SEQUENCE})")
    parser.add_argument("--frames", default="", help="numbers to take, such as 6-8")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds until the published schedule is cut off (default: %(default)g)")
    parser.add_argument("--cache", type=Path, default=CACHE, help="folder for generated frames")
    add_tracking_options(parser, PUBLISHED_RESOLUTION)
    arguments = parser.parse_args()
    source, numbers = arguments.input, arguments.frames
    if source is None:
        source, numbers = frames_folder(DEFAULT_SEQUENCE, DEFAULT_COUNT, arguments.cache), numbers or DEFAULT_FRAMES
    meshes = read_bodies(source, numbers)
    if len(meshes) < 2:
        parser.error("give at least two frames")
    rows, finished = compared(meshes, tracking_settings(arguments), arguments.limit)
    print("frame" + "".join(f"{name:>17}" for name in rows[0]))
    for index, row in enumerate(rows, 1):
        print(f"{index:5d}" + "".join(f"{value:17.5g}" for value in row.values()))
    print(json.dumps({"benchmark": "tracking", **figures(rows, finished)}))


if __name__ == "__main__":
    main()
